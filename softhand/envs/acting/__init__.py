"""What actions mean, one kind a file"""
