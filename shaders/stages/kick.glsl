// How long a kick between the substeps acts [s]: half a substep before the first and after the last one,
// else a whole one. Needs the accessors of one plan.
float KickSeconds(uint substep) {
  bool is_half = substep == DRAPE_BEFORE_FIRST_SUBSTEP || substep + 1u == cloth.substeps;
  return is_half ? cloth.half_h : cloth.h;
}

// Whether this cloth has a kick after this substep.
bool IsKickDue(uint substep) {
  return substep == DRAPE_BEFORE_FIRST_SUBSTEP || substep < cloth.substeps;
}
