// Cloth that is lit at its particles.
layout(location = 0) in vec3 front;
layout(location = 1) in vec3 back;
layout(location = 0) out vec4 picture;

void main() { picture = vec4(gl_FrontFacing ? front : back, 1.0); }
