"""A robot: `ovita adapt ... --robot acme-cart`."""

from ovita import Robot
from ovita.paths.robot import Box

CART = Robot("acme-cart", Box((-5.0, -5.0, -0.1), (5.0, 5.0, 2.0)), max_speed=0.4)
