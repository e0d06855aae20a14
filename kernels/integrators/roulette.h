// Russian roulette (Arvo and Kirk 1990): a path goes on with the probability `stays`, and carries as much more for those that end.
// `chance`: a number in (0, 1). The result says which of `here` go on.
#define STAYS_FOR R(1.5)    // times what it carries: less noise than that alone, for little more time
#define LONG_PATH 16        // bounces, after which every path ends in the end
#define LONG_STAYS R(0.95)

INLINE mask wins_roulette(color *through, real stays, real chance, mask here) {
    const mask goes_on = here & less(chance, stays);
    *through = color_pick(goes_on, color_scale(*through, R(1.0) / stays), *through);
    return goes_on;
}

// Ends paths that bring nothing, and from the bounce `first` on others by what they bring: those in clear glass go on.
INLINE mask path_stays(color *through, real chance, real bounce, int first, mask here) {
    here &= less(R(0.0), brightest(*through));
    const real cap = pick(less(bounce, (real)((scalar)LONG_PATH)), R(1.0), LONG_STAYS);
    const mask asked = here & less_equal((real)((scalar)first), bounce);
    return (here & ~asked) | wins_roulette(through, fmin(STAYS_FOR * brightest(*through), cap), chance, asked);
}
