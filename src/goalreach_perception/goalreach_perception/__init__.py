"""From image to state: LED spots, pose with covariance, regions and memberships."""
