// Random numbers and their uses: places in a pixel, on a disk, in a cone, on a hemisphere.
//
// Every random number is half of a point of one two-dimensional sequence, `unit_square(index, seed)`. The seed is a hash of
// the pixel's place in the picture and of the purpose, so that neither tiles nor the order of work change a picture.

// 32 random bits per lane.
typedef OF_LANES(uint) bits;
#define bits_load(array) JOIN(as_, OF_LANES(uint))(lanes_load(array))
#define real_of_bits(a) to_reals(JOIN(as_, OF_LANES(int))(a))  // of a < 2^31

// Purposes: independent sequences of the same pixel. Lights are numbered from PURPOSE_LIGHT on.
enum {
    PURPOSE_PIXEL, PURPOSE_POINTS, PURPOSE_LENS, PURPOSE_AMBIENT, PURPOSE_ENVIRONMENT, PURPOSE_LIGHT, PURPOSE_SHADOW_RAY, PURPOSE_CHOICE,
    PURPOSE_SCATTER, PURPOSE_CHOICES, PURPOSE_AIR, PURPOSE_WAVE, PURPOSE_FLIGHT, PURPOSE_GLOW, PURPOSE_SET_LIGHT, PURPOSE_WALL,
    PURPOSE_MIST,
    PURPOSE_CHAIN = PURPOSE_AMBIENT   // (no path has both)
};
#define PURPOSE_TIME 0xffffffffu

enum { FILTER_BOX, FILTER_TENT, FILTER_BLACKMAN_HARRIS };

// Integer hash with full avalanche (the finaliser of MurmurHash3, Appleby 2011).
INLINE bits hash_bits(bits a) {
    a ^= a >> 16;
    a *= 0x85ebca6bu;
    a ^= a >> 13;
    a *= 0xc2b2ae35u;
    return a ^ (a >> 16);
}

INLINE bits reversed(bits a) {
    a = (a << 16) | (a >> 16);
    a = ((a & 0x00ff00ffu) << 8) | ((a >> 8) & 0x00ff00ffu);
    a = ((a & 0x0f0f0f0fu) << 4) | ((a >> 4) & 0x0f0f0f0fu);
    a = ((a & 0x33333333u) << 2) | ((a >> 2) & 0x33333333u);
    return ((a & 0x55555555u) << 1) | ((a >> 1) & 0x55555555u);
}

// The seed of each lane's pixel for a purpose; `x` and `y` hold LANES places in the picture. Two hashes are added, then hashed
// again: of nested hashes, hash(x + hash(y)), now and then a row would be another one, shifted.
INLINE bits pixel_seed(const int *x, const int *y, uint seed, uint purpose) {
    const bits key = hash_bits((bits)(seed) + hash_bits((bits)(purpose + 0x9e3779b9u)));
    return hash_bits(hash_bits(bits_load(x) + key) + hash_bits(bits_load(y) + hash_bits(~key)));
}

// Owen's scrambling of reversed digits: each bit is flipped by a random function of the seed and the bits below it (Laine and
// Karras 2011, Stratified Sampling for Stochastic Transparency; the constants are Vegdahl's of 2021, which flip more evenly).
INLINE bits scramble_reversed(bits a, bits seed) {
    a ^= a * 0x3d20adeau;
    a += seed;
    a *= (seed >> 16) | 1u;
    a ^= a * 0x05526c56u;
    return a ^ (a * 0x53a22864u);
}

// Strictly within (0, 1), for float too: the middles of 2^23 (double: 2^31) equal intervals, all of them exact.
INLINE real unit_of_bits(bits a) {
#if REAL_IS_DOUBLE
    return (real_of_bits(a >> 1) + R(0.5)) * R(4.656612873077393e-10);
#else
    return (real_of_bits(a >> 9) + R(0.5)) * R(1.1920928955078125e-7);
#endif
}

// Point `index` of a sequence in the unit square, 0 < u, v < 1: Sobol's first two dimensions, scrambled after Owen, in an order
// shuffled likewise (Burley 2020, Practical Hash-based Owen Scrambling). Each 2^m points that begin at a multiple of 2^m lie
// one in each of the 2^m equal rectangles of any shape 2^-i x 2^-(m-i).
INLINE void unit_square(bits index, bits seed, real *u, real *v) {
    const bits place = reversed(scramble_reversed(reversed(index), hash_bits(seed)));
    // The second dimension's matrix is Pascal's triangle modulo 2, a Kronecker power of [1 1; 0 1]: a step for each factor.
    bits row = place;
    row ^= (row & 0xaaaaaaaau) >> 1;
    row ^= (row & 0xccccccccu) >> 2;
    row ^= (row & 0xf0f0f0f0u) >> 4;
    row ^= (row & 0xff00ff00u) >> 8;
    row ^= row >> 16;
    *u = unit_of_bits(reversed(scramble_reversed(place, hash_bits(seed + 0x9e3779b9u))));
    *v = unit_of_bits(reversed(scramble_reversed(row, hash_bits(seed + 0x3c6ef372u))));
}

// When a sample of each lane's pixel is taken: 0 is where the shutter opens, and 1 where it closes.
INLINE real shutter_time(const int *columns, const int *rows, uint seed, int sample) {
    real time, unused;
    unit_square((bits)((uint)sample), pixel_seed(columns, rows, seed, PURPOSE_TIME), &time, &unused);
    return time;
}

// Sine and cosine of an angle given in turns, at most an eighth of one either way: Taylor's series, right to a bit or two.
INLINE void sine_cosine(real turns, real *sine, real *cosine) {
    const real a = turns * R(6.283185307179586), a2 = a * a;
#if REAL_IS_DOUBLE
    const real s = R(2.7557319223985893e-6) + a2 * (R(-2.505210838544172e-8) + a2 * (R(1.6059043836821613e-10)
                   + a2 * R(-7.647163731819816e-13)));
    const real c = R(2.48015873015873e-5) + a2 * (R(-2.755731922398589e-7) + a2 * (R(2.08767569878681e-9)
                   + a2 * (R(-1.1470745597729725e-11) + a2 * R(4.779477332387385e-14))));
#else
    const real s = R(2.7557319e-6), c = R(2.4801587e-5);
#endif
    *sine = a + a * a2 * (R(-0.16666666666666666) + a2 * (R(8.333333333333333e-3) + a2 * (R(-1.984126984126984e-4) + a2 * s)));
    *cosine = R(1.0) + a2 * (R(-0.5) + a2 * (R(0.041666666666666664) + a2 * (R(-1.388888888888889e-3) + a2 * c)));
}

// Where the Blackman-Harris window (Harris 1978, 4 terms, 92 dB), 1 wide around 0, has passed the part `u` of its area. The
// guess is within 1e-3 and each step of Newton's method about squares the error: 3e-8 (double: 1e-12), but for rounding.
INLINE real blackman_harris_place(real u) {
    const real left = fmax(fmin(u, R(1.0) - u), R(1e-10));  // less than any number of the sequence
    const real z2 = fmax(-log(R(4.0) * left * (R(1.0) - left)), R(0.0));
    real place = sqrt(z2) * (R(0.180298986) + z2 * (R(-9.05787446e-4) + z2 * (R(-2.88277177e-4) + z2 * R(8.09420688e-6))));
    for (int step = 0; step < (REAL_IS_DOUBLE ? 3 : 2); ++step) {
        real s, c;
        sine_cosine(R(0.5) * place - R(0.125), &s, &c);
        const real sine = R(1.0) - R(2.0) * s * s, cosine = R(-2.0) * s * c;  // of the angle twice that, a quarter turn on
        const real area = place + sine * (R(0.2148965126612882) + cosine * (R(0.06267710204884452)
                          + cosine * R(0.006908914231129709)));
        const real density = R(0.6061881533101046) + cosine * (R(1.263414634146341) + cosine * (R(0.7876236933797909)
                             + cosine * R(0.1302299651567944)));
        place = clamp(place - (area - (R(0.5) - left)) / density, R(0.0), R(0.5));
    }
    return pick(less(u, R(0.5)), -place, place);
}

// Offset from the pixel's centre, in pixels, spread as a separable filter of the given whole width weighs: the mean of samples
// there is the filtered picture, without weights.
INLINE real filter_place(real u, int filter, real width) {
    if (filter == FILTER_TENT) {
        const real edge = R(1.0) - sqrt(R(2.0) * fmin(u, R(1.0) - u));
        return R(0.5) * width * pick(less(u, R(0.5)), -edge, edge);
    }
    if (filter == FILTER_BLACKMAN_HARRIS) return width * blackman_harris_place(u);
    return width * (u - R(0.5));
}
INLINE void filter_offset(real u, real v, int filter, real width, real *across, real *below) {
    *across = filter_place(u, filter, width);
    *below = filter_place(v, filter, width);
}

// Place of one of `count` points of a pixel: its offset from the centre, in pixels, within (-0.5, 0.5). A grid has
// `rows`, numbered along each from the top left. Stochastic points, which have none, are another set for each seed: one at a random
// place in each of `count` equal strips, a golden section of the pixel further along it than the last (so that no two are
// near each other), the first anywhere; the strips upright or level, mirrored or not.
INLINE void point_offset(int point, int count, int rows, bits seed, real *across, real *below) {
    if (rows > 0) {
        const scalar row = (scalar)(point / rows), column = (scalar)(point % rows), side = (scalar)rows;
        *across = (real)((S(2.0) * column + S(1.0) - side) / (S(2.0) * side));
        *below = (real)((S(2.0) * row + S(1.0) - side) / (S(2.0) * side));
        return;
    }
    const uint golden = 0x9e3779b9u;
    const bits first = hash_bits(seed), turn = hash_bits(first);
    const uint strips = (uint)count;
    const bits within = hash_bits(seed + golden * (uint)(point + 1));
    bits x = (bits)(0xffffffffu / strips * (uint)point) + within / strips;
    bits y = first + golden * (uint)point;  // of 2^32, as all here
    x ^= -(turn & 1u);
    const bits swapped = (x ^ y) & -((turn >> 1) & 1u);
    *across = unit_of_bits(x ^ swapped) - R(0.5);
    *below = unit_of_bits(y ^ swapped) - R(0.5);
}

// Point of the disk of radius 1, uniform in area (Shirley and Chiu 1997): squares around the middle become circles.
INLINE void unit_disk(real u, real v, real *x, real *y) {
    const real a = R(2.0) * u - R(1.0), b = R(2.0) * v - R(1.0);
    const mask steep = less(fabs(a), fabs(b));
    const real radius = pick(steep, b, a), other = pick(steep, a, b);
    real sine, cosine;
    sine_cosine(R(0.125) * other / pick(equal(radius, R(0.0)), R(1.0), radius), &sine, &cosine);
    *x = radius * pick(steep, sine, cosine);
    *y = radius * pick(steep, cosine, sine);
}

// Two directions that make a right-handed frame with a unit axis: side x up = axis (Duff et al. 2017, Building an Orthonormal
// Basis, Revisited).
INLINE void make_frame(vec axis, vec *side, vec *up) {
    const real sign = copysign(R(1.0), axis.z);
    const real a = R(-1.0) / (sign + axis.z), b = axis.x * axis.y * a;
    *side = vec_of(R(1.0) + sign * axis.x * axis.x * a, sign * b, -sign * axis.x);
    *up = vec_of(b, sign + axis.y * axis.y * a, -axis.y);
}

INLINE vec in_frame(vec axis, real x, real y, real z) {
    vec side, up;
    make_frame(axis, &side, &up);
    return vec_along(vec_along(vec_scale(axis, z), x, side), y, up);
}

// Direction uniform in the solid angle of a cone about a unit axis; `spread` is 1 - cos(half its opening angle), 0 to 2, so
// that cones of a hundredth of a degree keep their shape in float.
INLINE vec cone_direction(vec axis, real spread, real u, real v) {
    real x, y;
    unit_disk(u, v, &x, &y);
    const real height = spread * (x * x + y * y);  // below the cap's top, uniform
    const real reach = sqrt(fmax(spread * (R(2.0) - height), R(0.0)));
    return in_frame(axis, x * reach, y * reach, R(1.0) - height);
}

// Direction in the hemisphere about a unit normal, its density cos(angle) / pi per steradian: a disk, raised onto the sphere
// (Malley's method).
INLINE vec hemisphere_direction(vec normal, real u, real v) {
    real x, y;
    unit_disk(u, v, &x, &y);
    return in_frame(normal, x, y, sqrt(fmax(R(1.0) - x * x - y * y, R(0.0))));
}
