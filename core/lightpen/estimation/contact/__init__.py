"""The joint fit of one contact, from single images to all of them."""
