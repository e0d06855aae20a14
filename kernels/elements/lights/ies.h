// A luminaire as it was measured: `clfractal/elements/lights/ies.py` says what its table has.
#define DEGREES R(57.29577951308232)

// Of `count` angles the last one but one, or an earlier one behind which the given one lies.
INLINE int ies_before(__global const float *angles, int count, scalar angle) {
    int low = 0, high = count - 1;
    while (high - low > 1) {
        const int middle = (low + high) / 2;
        if ((scalar)angles[middle] <= angle) {
            low = middle;
        } else {
            high = middle;
        }
    }
    return low;
}

// Thousands of candela that go away from it opposite to `toward`.
CALLED real ies_shows(light_record light, const vec *toward, __global const float *tables) {
    const vec axis = vec_splat(light->axis), zero = vec_splat(light->zero);
    const real along = -vec_dot(*toward, axis), x = -vec_dot(*toward, zero), y = -vec_dot(*toward, vec_cross(zero, axis));
    const real turn = real_atan2(y, x) * DEGREES;
    scalar down[LANES], around[LANES], shows[LANES];
    lanes_store(fmin(real_atan2(sqrt(x * x + y * y), along) * DEGREES, R(180.0)), down);
    lanes_store(turn + pick(less(turn, R(0.0)), R(360.0), R(0.0)), around);
    __global const float *table = tables + light->table;
    const int rows = (int)table[0], columns = (int)table[1];
    __global const float *vertical = table + 2, *horizontal = vertical + rows, *values = horizontal + columns;
    for (int lane = 0; lane < LANES; ++lane) {
        const int row = ies_before(vertical, rows, down[lane]), column = ies_before(horizontal, columns, around[lane]);
        const scalar v = (down[lane] - (scalar)vertical[row]) / (scalar)(vertical[row + 1] - vertical[row]);
        const scalar h = (around[lane] - (scalar)horizontal[column]) / (scalar)(horizontal[column + 1] - horizontal[column]);
        __global const float *one = values + column * rows + row, *other = one + rows;
        const scalar mixed = mix(mix((scalar)one[0], (scalar)one[1], v), mix((scalar)other[0], (scalar)other[1], v), h);
        shows[lane] = v < S(0.0) || v > S(1.0) ? S(0.0) : mixed;
    }
    return lanes_load(shows);
}

INLINE incidence ies_light(light_record light, vec point, __global const float *tables) {
    incidence in = light_from_place(light, point);
    if (light->table >= 0) in.strength *= ies_shows(light, &in.toward, tables);
    return in;
}
