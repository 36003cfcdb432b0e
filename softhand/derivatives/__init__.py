"""One control period as a linear model: x' = A x + B u + E p, y = C x + D u + F p, open loop and closed"""
