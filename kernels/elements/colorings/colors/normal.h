// The thesis stores normals as (n + 1) / 2 in RGB (sec. 3.2.1).
INLINE color normal_color(vec normal, material_record material) {
    return color_of(R(0.5) * normal.x + R(0.5), R(0.5) * normal.y + R(0.5), R(0.5) * normal.z + R(0.5));
}
