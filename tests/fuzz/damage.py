"""Where nested tables and arrays can be damaged."""


def places(node, path=()):
    """List the paths of all values in nested tables and arrays."""
    items = node.items() if isinstance(node, dict) else enumerate(node)
    for key, value in items:
        yield (*path, key)
        if isinstance(value, dict | list):
            yield from places(value, (*path, key))


def parent_of(data, path):
    """Return the table or array that holds the value at a path."""
    for key in path[:-1]:
        data = data[key]
    return data
