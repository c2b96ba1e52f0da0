"""What is asked: task spaces and desired motion."""
