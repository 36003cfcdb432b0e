"""Gains of controllers for a grasp at rest: linear-quadratic, or by bandwidth and damping ratio"""
