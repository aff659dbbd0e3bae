// Stage `solve_elastic`: family by family, the elements of bending and shear along each line. The impulses of cells
// are applied in a phase of their own. Needs the accessors of one plan.
#include "lib/elastic.glsl"
#include "lib/vector.glsl"
#include "stages/substep.glsl"

// Elements of one kind and direction.
struct ElasticFamily {
  uint kind;  // DRAPE_ELASTIC_*
  float rest_length;  // [m]
  uint line_begin;
  uint line_end;
};

ElasticFamily LoadFamily(uint family) {
  uint word = cloth.model.elastic_families + DRAPE_ELASTIC_FAMILY_WORDS * family;
  return ElasticFamily(models[word], ModelFloat(word + 1u), models[word + 2u], models[word + 3u]);
}

struct ElasticLine {
  uint first;   // particle
  uint stride;  // from one particle to the next
  uint count;   // of particles
  uint entry_begin;
};

ElasticLine LoadElasticLine(uint line) {
  uint word = cloth.model.elastic_lines + DRAPE_ELASTIC_LINE_WORDS * line;
  return ElasticLine(models[word], models[word + 1u], models[word + 2u], models[word + 3u]);
}

// ElasticEntry of scene/elastic_lines.h.
struct ElasticEntry {
  float elasticity;
  float inverse_pivot;
  float to_next;
  float to_second_next;
};

ElasticEntry LoadEntry(uint entry) {
  uint word = cloth.parameters.elastic_entries + DRAPE_ELASTIC_ENTRY_WORDS * entry;
  return ElasticEntry(Parameter(word), Parameter(word + 1u), Parameter(word + 2u), Parameter(word + 3u));
}

// From particle i to j at the end of the substep, b + H u [m].
vec3 ElasticDifference(uint i, uint j) {
  precise vec3 position_difference = Position(j) - Position(i);
  precise vec3 velocity_difference = Velocity(j) - Velocity(i);
  return AddScaled(position_difference, substep.interval, velocity_difference);
}

// Working memory at a particle: what SolveRods, SolveDiagonals and SolveCells leave for their way back.
uint SolutionWord(uint i) { return cloth.scratch.elastic_solutions + DRAPE_ELASTIC_SOLUTION_WORDS * i; }

// How long forces act on u [s].
float ForceTime() { return IsTwoStep() ? substep.kick_within : substep.interval; }

#ifdef HAS_IMPULSES
// On particle i, if it is held: the row of s K x, from the moments before, at and after it, is taken off the right side.
void PullByRods(uint i, vec3 at_before, vec3 at_this, vec3 at_after) {
  precise vec3 row = (at_before - at_this) + (at_after - at_this);
  if (InverseMass(i) == 0.0) Pull(i, -row);
}
#endif

// Changes the velocities of a line by x with (M + s K) x = impulses.
void SolveRods(ElasticLine line) {
  float force_time = ForceTime();
  // Between particle k and the next the rods act by the moment (over the spacing) at k, less that at the next.
  vec3 ahead = ElasticDifference(line.first, line.first + line.stride);
  vec3 moment = vec3(0.0), before = vec3(0.0);
  vec3 last = vec3(0.0), second_last = vec3(0.0);  // partial solutions
  float last_to_this = 0.0, last_to_next = 0.0, second_last_to_this = 0.0;
#ifdef HAS_IMPULSES
  float s = Parameter(cloth.impulses + DRAPE_IMPULSE_ELASTIC_S);
#endif
  for (uint k = 0u; k < line.count; ++k) {
    uint i = line.first + k * line.stride;
    vec3 here = moment;
    moment = vec3(0.0);
    if (k + 2u < line.count) {
      vec3 next = ElasticDifference(i + line.stride, i + 2u * line.stride);
      precise vec3 of_next = (next - ahead) * LoadEntry(line.entry_begin + k + 1u).elasticity;
      moment = of_next;
      ahead = next;
    }
    precise vec3 impulse = here - moment;
    precise vec3 partial =
        ((impulse - before) * force_time - last * last_to_this) - second_last * second_last_to_this;
    SetScratchVector(SolutionWord(i), partial);
#ifdef HAS_IMPULSES
    precise vec3 right_side = (impulse - before) * force_time;
    if (InverseMass(i) == 0.0) Pull(i, right_side);
#endif
    before = impulse;
    second_last = last;
    last = partial;
    ElasticEntry entry = LoadEntry(line.entry_begin + k);
    second_last_to_this = last_to_next;
    last_to_this = entry.to_next;
    last_to_next = entry.to_second_next;
  }
  vec3 next = vec3(0.0), second_next = vec3(0.0);
#ifdef HAS_IMPULSES
  // s times the moments by x at the rods in the middle of the second and third particle after this one.
  vec3 at_second = vec3(0.0), at_third = vec3(0.0);
#endif
  for (uint k = line.count; k-- > 0u;) {
    uint i = line.first + k * line.stride;
    ElasticEntry entry = LoadEntry(line.entry_begin + k);
    precise vec3 x = (ScratchVector(SolutionWord(i)) * entry.inverse_pivot - next * entry.to_next) -
                     second_next * entry.to_second_next;
    precise vec3 velocity = Velocity(i) + x;
    if (entry.inverse_pivot != 0.0 && InverseMass(i) != 0.0) SetVelocity(i, velocity);
#ifdef HAS_IMPULSES
    precise vec3 at_next = vec3(0.0);
    if (k + 2u < line.count) {
      at_next = s * LoadEntry(line.entry_begin + k + 1u).elasticity * ((second_next - next) - (next - x));
      PullByRods(i + 2u * line.stride, at_next, at_second, at_third);
    }
    at_third = at_second;
    at_second = at_next;
#endif
    second_next = next;
    next = x;
  }
#ifdef HAS_IMPULSES
  // at_second is now at the second particle.
  if (line.count > 1u) PullByRods(line.first + line.stride, vec3(0.0), at_second, at_third);
  PullByRods(line.first, vec3(0.0), vec3(0.0), at_second);
#endif
}

// By which lines are solved: a line knows pins, but not what grips hold. What it would do to that is left out
// (server/solver/method.md, "Grips").
float LineMass(uint i) {
#ifdef HAS_GRIPS
  return ModelFloat(cloth.model.inverse_masses + i);
#else
  return InverseMass(i);
#endif
}

void PushElastic(uint i, vec3 impulse) {
  float inverse_mass = InverseMass(i);
#ifdef HAS_IMPULSES
  if (inverse_mass == 0.0) Pull(i, impulse);
#endif
  precise vec3 velocity = Velocity(i) + impulse * inverse_mass;
  if (inverse_mass != 0.0) SetVelocity(i, velocity);
}

// As a strip of compliant links (solve_strips.glsl), whose pivots the compliances keep apart from 0.
void SolveDiagonals(ElasticLine line, float rest_length) {
  precise float inverse_s = InverseForceTime() * substep.inverse_interval;
  vec3 n_before = vec3(0.0);
  precise float inverse_pivot = 0.0;
  precise float impulse = 0.0;
  float inverse_mass = LineMass(line.first);
  for (uint k = 0u; k + 1u < line.count; ++k) {
    uint i = line.first + k * line.stride;
    float inverse_mass_next = LineMass(i + line.stride);
    vec3 d = ElasticDifference(i, i + line.stride);
    float len = Length(d);
    vec3 n = Direction(d, len, vec3(1.0, 0.0, 0.0));
    precise float pivot =
        (inverse_mass + inverse_mass_next) + LoadEntry(line.entry_begin + k).elasticity * inverse_s;
    precise float right_side = -((len - rest_length) * substep.inverse_interval);
    if (k > 0u) {
      precise float coupling = -(Dot(n_before, n) * inverse_mass);
      precise float ratio = coupling * inverse_pivot;
      scratch[SolutionWord(i - line.stride) + 3u] = ratio;
      pivot = pivot - coupling * ratio;
      right_side = right_side - coupling * impulse;
    }
    inverse_pivot = 1.0 / pivot;
    impulse = right_side * inverse_pivot;
    n_before = n;
    inverse_mass = inverse_mass_next;
    SetScratchVector(SolutionWord(i), n);
    scratch[SolutionWord(i) + 4u] = impulse;
  }
  vec3 pull_of_next = vec3(0.0);  // impulse * n of the link behind
  for (uint k = line.count - 1u; k-- > 0u;) {
    uint i = line.first + k * line.stride;
    precise float solution = scratch[SolutionWord(i) + 4u];
    if (k + 2u < line.count) solution = solution - scratch[SolutionWord(i) + 3u] * impulse;
    impulse = solution;
    precise vec3 pull = impulse * ScratchVector(SolutionWord(i));
    precise vec3 change = pull - pull_of_next;
    PushElastic(i + line.stride, change);
    pull_of_next = pull;
  }
  PushElastic(line.first, -pull_of_next);
}

// The impulses of a row of cells. No velocity changes.
void SolveCells(ElasticLine line) {
  float force_time = ForceTime();
  uint columns = cloth.grid_columns;
  // The particles of the two rows at the same place are a rung.
  vec3 rung = ElasticDifference(line.first, line.first + columns);
  vec3 before = vec3(0.0);
  float to_this = 0.0;
  for (uint k = 0u; k + 1u < line.count; ++k) {
    uint i = line.first + k;
    vec3 next_rung = ElasticDifference(i + 1u, i + 1u + columns);
    precise vec3 y = (rung - next_rung) * force_time - before * to_this;
    SetScratchVector(SolutionWord(i), y);
    rung = next_rung;
    before = y;
    to_this = LoadEntry(line.entry_begin + k).to_next;
  }
  vec3 next = vec3(0.0);
  for (uint k = line.count - 1u; k-- > 0u;) {
    uint word = SolutionWord(line.first + k);
    ElasticEntry entry = LoadEntry(line.entry_begin + k);
    precise vec3 y = ScratchVector(word) * entry.inverse_pivot - next * entry.to_next;
    SetScratchVector(word, y);
    next = y;
  }
}

// What the cells after particle i of its row, above and below it, do to it [N s].
vec3 CellsAfter(uint i) {
  uint row = i / cloth.grid_columns;
  if (i % cloth.grid_columns + 1u == cloth.grid_columns) return vec3(0.0);
  precise vec3 impulse = vec3(0.0);
  if (row + 1u < cloth.grid_rows) impulse = ScratchVector(SolutionWord(i));
  if (row > 0u) impulse = impulse - ScratchVector(SolutionWord(i - cloth.grid_columns));
  return impulse;
}

void ApplyCells(uint i) {
  vec3 before = vec3(0.0);
  if (i % cloth.grid_columns > 0u) before = CellsAfter(i - 1u);
  precise vec3 impulse = CellsAfter(i) - before;
  PushElastic(i, impulse);
}

void SolveElasticLine(ElasticFamily family, uint index) {
  ElasticLine line = LoadElasticLine(index);
  if (family.kind == DRAPE_ELASTIC_RODS) {
    SolveRods(line);
  } else if (family.kind == DRAPE_ELASTIC_DIAGONALS) {
    SolveDiagonals(line, family.rest_length);
  } else {
    SolveCells(line);
  }
}
