"""The scene `stand`: inverse dynamics of a humanoid on two feet, one tick of each package."""
