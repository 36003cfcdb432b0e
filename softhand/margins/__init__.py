"""How far a closed loop is from where it is lost: modes, delay, control period, gains, noise"""
