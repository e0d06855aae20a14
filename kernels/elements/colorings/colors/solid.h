// The material's own.
INLINE color solid_color(vec normal, material_record material) { return color_splat(material->color); }
