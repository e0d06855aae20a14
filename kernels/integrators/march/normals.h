// Normals from the points where a pixel's rays meet the surface (Englund 2010, sec. 3.2.3).
//
// All points and normals are in the pixel's frame: x to the right, y up, z to the viewer, scene units. Points are relative
// to a place nearby (the pixel's centre on the surface, say), or their coordinates have lost the digits that differ.
// Footprints may be of any size from 1e-15 to 1e12 in float32. A normal has length 1 and z > 0; where none can be made,
// `usable` is false and the normal points to the viewer, (0, 0, 1). Missing points may hold anything, NaN too.

// Thinnest pattern of points that still tells a plane: the square of its width over its length. Any three or more points of
// an 8 x 8 grid that are not on one line have 1.3e-4 at least; of points on one line rounding makes some 1e-13.
#define THINNEST_PATTERN S(2.5e-5)
// Least sine of the angle between two edges of a triangle, as the viewer sees it.
#define THINNEST_TRIANGLE S(1e-4)

// The least-squares plane z = p0 + x p1 + y p2 of the points so far. Instead of A^T A it holds what Gaussian elimination
// makes of it, kept up to date point by point with plane rotations (Gentleman 1973, "Least squares computations by Givens
// transformations without square roots"). Nothing cancels that way, neither the means nor the residual.
typedef struct {
    real n;         // points
    real x, y, z;   // their mean
    real xx;        // sum of (X - x)^2
    real xy, xz;    // slopes of y and of z over x, by least squares
    real yy;        // sum of squares of what x leaves of y
    real yz;        // slope over that of what x leaves of z: p2
    real zz;        // sum of squares of what x and y leave of z
} plane_sums;

INLINE plane_sums plane_none(void) {
    const real zero = R(0.0);
    return (plane_sums){zero, zero, zero, zero, zero, zero, zero, zero, zero, zero};
}

// The sums with one more point in the lanes where it is found.
INLINE plane_sums plane_add(plane_sums s, mask found, vec p) {
    // The means. The point's offset goes on with the weight that the mean leaves it: none for the first point.
    const real dx_given = pick(found, p.x - s.x, R(0.0));
    const real dy = pick(found, p.y - s.y, R(0.0));
    const real dz = pick(found, p.z - s.z, R(0.0));
    // A row's x that differs by rounding alone would make slopes over x that overflow.
    const real dx = pick(less((real)(REAL_EPSILON) * fabs(dy), fabs(dx_given)), dx_given, R(0.0));
    const real count = s.n + pick(found, R(1.0), R(0.0));
    const real share = pick(found, R(1.0), R(0.0)) / most(R(1.0), count);
    const real weight = share * s.n;
    s.n = count;
    s.x += share * dx_given;
    s.y += share * dy;
    s.z += share * dz;

    // Slopes over x.
    const real square = s.xx + (weight * dx) * dx;
    const mask wide = less((real)(REAL_SMALLEST), square);
    const real keep = pick(wide, s.xx / square, R(1.0)), turn = pick(wide, weight * dx / square, R(0.0));
    const real ey = dy - dx * s.xy, ez = dz - dx * s.xz;
    s.xy = keep * s.xy + turn * dy;
    s.xz = keep * s.xz + turn * dz;
    s.xx = square;

    // The slope of what is left over what is left of y, and the residual.
    const real weight_left = weight * keep;
    const real square_left = s.yy + (weight_left * ey) * ey;
    const mask high = less((real)(REAL_SMALLEST), square_left);
    const real keep_left = pick(high, s.yy / square_left, R(1.0));
    const real turn_left = pick(high, weight_left * ey / square_left, R(0.0));
    const real fz = ez - ey * s.yz;
    s.yz = keep_left * s.yz + turn_left * ez;
    s.yy = square_left;
    s.zz += (weight_left * keep_left * fz) * fz;
    return s;
}

// N = (-p1, -p2, 1), normalised. `residual`: root mean square of the points' distances from the plane, scene units (0 where
// not usable). Not usable: fewer than three points, points on one line as the viewer sees them.
INLINE vec normal_of_plane(plane_sums s, real *residual, mask *usable) {
    const real spread = s.xx * (R(1.0) + s.xy * s.xy) + s.yy;  // sums of squares of x and of y
    // One of the two is exactly 0 with fewer than three points; with none 0 / 0 is no number, which is above nothing.
    const mask planar = less((real)(THINNEST_PATTERN), (s.xx / spread) * (s.yy / spread));
    const real p2 = s.yz, p1 = s.xz - s.xy * s.yz;
    const vec normal = vec_normalize(vec_of(-p1, -p2, R(1.0)));
    const real away = sqrt(s.zz / most(R(1.0), s.n)) * normal.z;
    *usable = planar & less(R(0.0), normal.z) & less_equal(away, (real)(REAL_LARGEST));
    *residual = pick(*usable, away, R(0.0));
    return vec_pick(*usable, normal, vec_of(R(0.0), R(0.0), R(1.0)));
}

// The normal of one triangle whose corners turn to the left as the viewer sees them. Not usable if they are on one line.
INLINE vec corners_normal(vec a, vec b, vec c, mask *usable) {
    const vec p = vec_sub(b, a), q = vec_sub(c, a);
    const real seen = p.x * q.y - p.y * q.x;  // twice the area
    const vec normal = vec_normalize(vec_of(p.y * q.z - p.z * q.y, p.z * q.x - p.x * q.z, seen));
    const real lengths = sqrt(p.x * p.x + p.y * p.y) * sqrt(q.x * q.x + q.y * q.y);
    *usable = less((real)(THINNEST_TRIANGLE) * lengths, seen) & less(R(0.0), normal.z);
    return vec_pick(*usable, normal, vec_of(R(0.0), R(0.0), R(1.0)));
}

// Least squares over the points of a 3 x 3 grid that were found.
INLINE vec compass_plane(const vec *compass, const mask *found, mask *usable) {
    plane_sums sums = plane_none();
    #pragma unroll 1
    for (int i = 0; i < TURNS(9); ++i) sums = plane_add(sums, found[i], compass[i]);
    real residual;
    return normal_of_plane(sums, &residual, usable);
}

// Where a normal is not `whole`, that of the plane of the points which are there.
INLINE vec or_plane(vec normal, mask whole, const vec *compass, const mask *found, mask *usable) {
    *usable = whole;
    if (!any_lane(~whole)) return normal;
    mask planar;
    const vec plane = compass_plane(compass, found, &planar);
    *usable = whole | planar;
    return vec_pick(whole, normal, plane);
}

// N = (LR - LL) x (U - LL) of the lower corners and the upper middle of a 3 x 3 grid, row-major from the top left. Where one
// of the three is missing, the plane of those that are there.
INLINE vec triangle_normal(const vec *compass, const mask *found, mask *usable) {
    mask whole;
    const vec normal = corners_normal(compass[6], compass[8], compass[1], &whole);
    return or_plane(normal, whole & found[6] & found[8] & found[1], compass, found, usable);
}

// The eight triangles around the centre (index 4) of a 3 x 3 grid, to the left from the one between upper left and left. One
// is not usable where a corner is missing, none where the centre is.
INLINE void eight_normals(const vec *compass, const mask *found, vec *normals, mask *usable) {
    const int around[9] = {0, 3, 6, 7, 8, 5, 2, 1, 0};
    for (int i = 0; i < TURNS(8); ++i) {
        const int first = around[i], second = around[i + 1];
        mask spread;
        const vec normal = corners_normal(compass[4], compass[first], compass[second], &spread);
        usable[i] = spread & found[4] & found[first] & found[second];
        normals[i] = vec_pick(usable[i], normal, vec_of(R(0.0), R(0.0), R(1.0)));
    }
}

// The mean of the usable of eight normals, length 1; the plane of the points that are there if none is usable.
INLINE vec eight_mean(const vec *compass, const mask *found, mask *usable) {
    vec normals[8], sum = vec_of(R(0.0), R(0.0), R(0.0));
    mask each[8], some = less(R(1.0), R(0.0));
    eight_normals(compass, found, normals, each);
    for (int i = 0; i < TURNS(8); ++i) {
        sum = vec_pick(each[i], vec_add(sum, normals[i]), sum);
        some |= each[i];
    }
    return or_plane(vec_normalize(sum), some, compass, found, usable);
}
