"""From image to state: LED blobs, pose with covariance, regions and memberships."""
