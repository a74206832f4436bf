"""The links as plane-stress bodies in scikit-fem: what beam theory itself leaves out."""
