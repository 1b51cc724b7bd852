"""Language models as policy writers: in the cloud, on a server, or inside this process."""
