"""The links as plane-stress bodies in scikit-fem: the error of beam theory itself."""
