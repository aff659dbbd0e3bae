// What is opaque is stored as sRGB by the shader, once for all samples of a pixel; what is blended is stored by the
// device, which has to read what is there. Nothing drawn: 0, and alpha 0.
#include "lib/srgb.glsl"

vec4 Opaque(vec3 light) { return vec4(SrgbFromLinear(clamp(light, 0.0, 1.0)), 1.0); }
