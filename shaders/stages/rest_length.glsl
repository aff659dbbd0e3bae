// The rest length of a distance constraint [m]: the model's, or the cloth's own, which changes linearly
// within the step. Needs the storage blocks.
#ifdef HAS_OWN_LENGTHS
// The share of the step that is over at the end of this substep, in (0, 1]; set before the sweeps.
float step_share = 1.0;

void SetStepShare(uint index) {
  precise float share = float(index + 1u) / float(cloth.step.substeps);
  step_share = share;
}

float RestLength(uint k) {
  float target = Parameter(cloth.parameters.length_targets + k);
  if (step_share >= 1.0) return target;
  float start = Parameter(cloth.parameters.length_starts + k);
  precise float rest_length = start + (target - start) * step_share;
  return rest_length;
}
#else
void SetStepShare(uint index) {}

float RestLength(uint k) { return ModelFloat(cloth.model.rest_lengths + k); }
#endif
