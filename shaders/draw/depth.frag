// Only the depth: the pass of the shadow map.
void main() {}
