// Rectangles as a point sees them, chosen by solid angle (Urena, Fajardo and King, An Area-Preserving Parametrization for
// Spherical Rectangles, EGSR 2013): close to a large one, or beside it, places chosen by area would be noise. Where it fills next to
// nothing, areas do as well, and the difference of angles has lost its digits: there places are chosen by area.
#define LIGHT_PI R(3.141592653589793)
#define LEAST_ANGLE R(0.01)

// The point is the origin; x goes along the rectangle's side, y along its other, z through its plane.
typedef struct {
    real left, right, lower, upper, height;   // the last one above 0
    real angle;                               // steradians
    real below, above, turned;                // b0, b1 and k of the paper
} seen_rectangle;

INLINE seen_rectangle rectangle_between(real left, real right, real lower, real upper, real height) {
    // Of the planes through the point and a side: the part of their normals that is across the rectangle.
    const real square = height * height;
    const real below = -lower / sqrt(lower * lower + square), above = upper / sqrt(upper * upper + square);
    const real at_right = right / sqrt(right * right + square), at_left = -left / sqrt(left * left + square);
    const real turned = R(2.0) * LIGHT_PI - real_acos(-above * at_left) - real_acos(-at_left * below);
    const real angle = real_acos(-below * at_right) + real_acos(-at_right * above) - turned;
    return (seen_rectangle){left, right, lower, upper, height, angle, below, above, turned};
}

// A place of it; z is its height.
INLINE vec rectangle_place(const seen_rectangle *r, real u, real v) {
    const real turn = u * r->angle + r->turned, sine = sin(turn);
    const real slope = (cos(turn) * r->below - r->above) / pick(less(fabs(sine), R(1e-12)), R(1e-12), sine);
    real along = R(1.0) / sqrt(slope * slope + r->below * r->below);
    along = least(pick(less(slope, R(0.0)), -along, along), R(1.0) - (real)(REAL_EPSILON));
    along = most(along, (real)(REAL_EPSILON) - R(1.0));
    real x = along * r->height / sqrt(R(1.0) - along * along);
    x = most(least(x, r->right), r->left);
    const real square = x * x + r->height * r->height;
    const real first = r->lower / sqrt(square + r->lower * r->lower), last = r->upper / sqrt(square + r->upper * r->upper);
    const real up = first + v * (last - first);
    real y = up * sqrt(square / most(R(1.0) - up * up, (real)(REAL_EPSILON)));
    y = most(least(y, r->upper), r->lower);
    const mask small = less(r->angle, LEAST_ANGLE);
    x = pick(small, r->left + u * (r->right - r->left), x);
    y = pick(small, r->lower + v * (r->upper - r->lower), y);
    return vec_of(x, y, r->height);
}

// Per steradian, of `rectangle_place`, for a direction that meets the rectangle; `facing` is its part along z.
INLINE real rectangle_place_density(const seen_rectangle *r, real area, real facing) {
    facing = most(facing, (real)(REAL_EPSILON));
    const real distance = r->height / facing;
    return pick(less(r->angle, LEAST_ANGLE), distance * distance / (area * facing), R(1.0) / r->angle);
}
