"""Trajectories, scenes, frames and their geometry: numpy only, in the sandbox too."""
