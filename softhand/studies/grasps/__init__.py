"""Thousands of grasps at rest of one hand and one object, as one data set"""
