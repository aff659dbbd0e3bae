// Results of light_particles: the colours of the front (f) and of the back (b) of a particle, sRGB, as pairs of 16 bits
// fr fg, fb br, bg bb.
layout(std430, binding = DRAPE_DRAW_BINDING_LIT) LIT_ACCESS buffer Lit {
  uint lit[];  // [][DRAPE_DRAW_LIT_WORDS]
};
