#include "draw/light.glsl"
#include "draw/picture.glsl"

layout(location = 0) in vec3 position;
layout(location = 1) in vec3 normal;
layout(location = 2) flat in vec3 colour;
layout(location = 0) out vec4 picture;

void main() { picture = Opaque(ShadedColour(colour, position, normalize(normal), 0.12)); }
