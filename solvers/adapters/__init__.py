"""Problems from and for other packages: pink, mink and MuJoCo."""
