// Results of shade_vertices for each particle: smooth normal (0 without a surface), value.
layout(std430, binding = DRAPE_DRAW_BINDING_SHADED) readonly buffer Shaded { vec4 shaded[]; };
