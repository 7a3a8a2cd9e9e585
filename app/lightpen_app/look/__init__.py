"""Words, numbers, colours and sounds: how things look and are said."""
