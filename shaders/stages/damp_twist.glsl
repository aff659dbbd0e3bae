// Stage `damp_twist`. Two phases, so that all twists come from the same velocities: the change of each
// particle, then the sums. Needs the accessors of one plan.
#include "stages/substep.glsl"

// The share that each corner loses of the twist of the cell whose first corner is at (row, column);
// 0 outside the grid.
vec3 CellTwist(int row, int column) {
  if (row < 0 || column < 0 || row + 1 >= int(cloth.grid_rows) ||
      column + 1 >= int(cloth.grid_columns)) {
    return vec3(0.0);
  }
  uint i = uint(row) * cloth.grid_columns + uint(column);
  precise vec3 upper = Velocity(i) - Velocity(i + 1u);
  precise vec3 lower = Velocity(i + cloth.grid_columns) - Velocity(i + cloth.grid_columns + 1u);
  precise vec3 twist = substep.twist_share * (upper - lower);
  return twist;
}

#ifdef OWNS_PARTICLE
vec3 twist_change;
vec3 TwistChange(uint i) { return twist_change; }
void SetTwistChange(uint i, vec3 change) { twist_change = change; }
#else
vec3 TwistChange(uint i) { return ScratchVector(cloth.scratch.twist_changes + 3u * i); }
void SetTwistChange(uint i, vec3 change) { SetScratchVector(cloth.scratch.twist_changes + 3u * i, change); }
#endif

void StoreTwistChange(uint i) {
  int row = int(i / cloth.grid_columns), column = int(i % cloth.grid_columns);
  precise vec3 above = CellTwist(row - 1, column) - CellTwist(row - 1, column - 1);
  precise vec3 below = CellTwist(row, column - 1) - CellTwist(row, column);
  precise vec3 change = above + below;
  SetTwistChange(i, change);
}

void ApplyTwistChange(uint i) {
#ifdef HAS_IMPULSES
  precise vec3 impulse = ModelFloat(cloth.model.masses + i) * TwistChange(i);
  if (InverseMass(i) == 0.0) Pull(i, impulse);
#endif
  if (InverseMass(i) == 0.0) return;
  precise vec3 u = Velocity(i) + TwistChange(i);
  SetVelocity(i, u);
}
