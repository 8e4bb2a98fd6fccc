"""The built-in algorithms by name, the best for general use first."""

#: Each is a file of this folder whose function has the same name.
BUILT_IN = (
    'mpack_lite',
    'mpack',
    'rollout',
    'foresight',
    'first_fit',
    'best_fit',
    'o_first_fit',
    'o_best_fit',
    'o_jampack',
    'dbl',
    'lsah',
    'heightmap_min',
    'online_bph',
    'walle',
    'floor_building',
    'column_building',
    'best_short_side_fit',
)
