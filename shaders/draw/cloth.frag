// Cloth, lit at each pixel.
#include "draw/cloth_colour.glsl"
#include "draw/picture.glsl"

layout(location = 0) in vec3 position;
layout(location = 1) in vec3 normal;
layout(location = 2) in float value;
layout(location = 3) flat in vec3 colour;
layout(location = 0) out vec4 picture;

void main() { picture = Opaque(ClothColour(position, normal, gl_FrontFacing, value, colour)); }
