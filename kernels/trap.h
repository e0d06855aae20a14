// A trap: a point, an axis or plane through it, or the sphere around it.
typedef struct {
    int shape;
    vec center, direction;
    real radius;
} trap;
