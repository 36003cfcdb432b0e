"""Many runs at once, compiled"""
