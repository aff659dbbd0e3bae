#include "draw/light.glsl"

layout(location = 0) in vec3 position;
layout(location = 1) in vec3 normal;
layout(location = 2) flat in vec3 colour;
layout(location = 0) out vec4 picture;

void main() { picture = vec4(ShadedColour(colour, position, normalize(normal), 0.12), 1.0); }
