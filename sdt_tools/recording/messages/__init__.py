"""What a recording holds: topics, schemas, and our messages to and from protobuf."""
