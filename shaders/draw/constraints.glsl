// Constraints and pins of a model.
layout(std430, binding = DRAPE_DRAW_BINDING_CONSTRAINTS) readonly buffer Constraints {
  uint constraint_words[];
};
