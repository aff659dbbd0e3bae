// Stage `solve_strips` from both ends (server/solver/method.md, "solve_strips"), by a work group: each invocation
// linearises a link; cyclic reduction divides long strips into systems of every 2^n-th link, and solves those that
// meet pins; two invocations per system eliminate its rows from its ends towards the middle and substitute back; each
// applies the impulse of its link. So only few pivots are found one after the other. Needs the accessors of one plan,
// StripEnds and STRIP_ROWS.
#include "lib/strip_reduction.glsl"
#include "stages/solve_strips.glsl"

// A block of strips has at most STRIP_ROWS links, the size of the work group, and so few strips that there are two
// invocations per system.
const uint kRowPlaces = uint(STRIP_ROWS) + uint(STRIP_ROWS) / 32u;

// Four numbers of each link of a block, by the steps of MeetStrips. The equations are divided by their pivots:
//   x  -            effect of the impulse before on this error [-]                                    ratio of the move
//   y  direction.x  that of the impulse after                                                         pull.x [N s]
//   z  direction.y  right side [N s]; with the rows before eliminated; impulse                        pull.y
//   w  direction.z  excess of StripRow; least pivot [-]; effect of the next impulse over the pivot    pull.z
// At the first link of a strip x says whether any of the strip has an error larger than the tolerance. At the last
// link of a half, until it has met the other, x or y, whichever the half has used, is the least pivot over the pivot.
// The links of a strip are neighbours, and strips an odd number of rows apart where there is room: those who eliminate
// then meet no bank twice.
shared vec4 shared_rows[kRowPlaces];
shared uint shared_pins[(kRowPlaces + 31u) / 32u];  // a bit for each row whose `to` is a pin
shared uint shared_has_pins;    // whether there is one
shared uint shared_has_excess;  // whether a particle of the block moves too far

vec3 RowVector(uint row) {
  vec4 numbers = shared_rows[row];
  return vec3(numbers.y, numbers.z, numbers.w);
}

void FlagPin(uint row) {
  atomicOr(shared_pins[row >> 5], 1u << (row & 31u));
  shared_has_pins = 1u;  // all writers write the same
}

// The first of the rows [begin, end) whose `to` is a pin; `end` if none is.
uint FirstPin(uint begin, uint end) {
  uint found = end;
#ifdef HAS_PINS
  for (uint row = begin; row < found; row = (row | 31u) + 1u) {
    uint pins = shared_pins[row >> 5] >> (row & 31u);
    if (pins != 0u) found = min(found, row + uint(findLSB(pins)));
  }
#endif
  return found;
}

// The place of a link in its strip, and of its row.
struct LinkRow {
  uint k;
  uint link_count;  // of the strip
  uint row;
};

LinkRow LoadLinkRow(uint place) {
  uint word = models[cloth.model.strip_rows + place];
  return LinkRow(word & 0x3ffu, (word >> 10 & 0x3ffu) + 1u, word >> 20);
}

// A link of this invocation.
struct SideLink {
  bool is_link;
  uint place;  // in the lists of links
  LinkRow at;
  uint from;  // particles
  uint to;
  LinearisedLink link;
  float impulse;   // [N s]
  bool is_solved;  // its strip is solved by reduction alone
  bool is_active;  // any link of its strip has an error larger than the tolerance
};

uint FirstRowOfStrip(LinkRow at) { return at.row - at.k; }
bool HasNext(LinkRow at) { return at.k + 1u < at.link_count; }

SideLink LoadSideLink(uint place, uint end, bool is_first_sweep) {
  DistanceError no_error = DistanceError(vec3(0.0), 0.0);
  SideLink mine = SideLink(place < end, place, LinkRow(0u, 0u, 0u), 0u, 0u,
                           LinearisedLink(0.0, no_error, vec3(0.0), 1.0), 0.0, false, false);
  if (!mine.is_link) return mine;
  uvec2 ends = StripEnds(place);
  float rest_length = ModelFloat(cloth.model.strip_lengths + place);
  mine.at = LoadLinkRow(place);
  mine.from = ends.x;
  mine.to = ends.y;
  mine.link = LineariseLink(place, rest_length, LoadEnd(mine.from), LoadEnd(mine.to), is_first_sweep);
  return mine;
}

// The effects of its neighbours' impulses on its error, before and after it [1/kg].
vec2 LoadNeighbours(SideLink mine) {
  vec2 effects = vec2(0.0);
  if (!mine.is_link) return effects;
  vec3 n_end = mine.link.error.direction;
  if (mine.at.k > 0u) {
    effects.x = StripCoupling(RowVector(mine.at.row - 1u), n_end, InverseMass(mine.from));
  }
  if (HasNext(mine.at)) {
    effects.y = StripCoupling(RowVector(mine.at.row + 1u), n_end, InverseMass(mine.to));
  }
  return effects;
}

StripRow RowOf(SideLink mine, vec2 effects) {
  float right_side = StripRightSide(mine.link.error.residual, substep.inverse_link_interval);
  return FirstRow(mine.link.diagonal, effects.x, effects.y, right_side);
}

// x of the first row of a strip is not its link's, which has no link before.
void StoreRow(LinkRow at, float before, float after, float right_side, float last) {
  if (at.k > 0u) {
    shared_rows[at.row] = vec4(before, after, right_side, last);
  } else {
    shared_rows[at.row].y = after;
    shared_rows[at.row].z = right_side;
    shared_rows[at.row].w = last;
  }
}

// The row of a link, or none.
StripRow LoadRow(uint row) {
  vec4 numbers = shared_rows[row];
  return StripRow(numbers.x, numbers.y, numbers.z, numbers.w);
}
StripRow NoRow() { return StripRow(0.0, 0.0, 0.0, 0.0); }
StripRow RowBefore(LinkRow at, uint stride) {
  if (at.k < stride) return NoRow();
  StripRow row = LoadRow(at.row - stride);
  if (at.k == stride) row.before = 0.0;  // the first one
  return row;
}
// Eliminates from each equation those of both neighbours, so that every other link is left, and again. A strip that
// meets pins is reduced until each equation is alone: between two pins it has a link too many, whose pivot the
// elimination raises where it ends at a pin, so that this link is eliminated from no other. Replaces the excesses of
// the rows by the least pivots. In uniform control flow.
void ReduceRows(inout SideLink mine, StripRow row) {
  uint end = FirstRowOfStrip(mine.at) + mine.at.link_count;
  uint pin = mine.is_link ? FirstPin(mine.at.row, end) : end;  // the next one
  mine.is_solved = mine.is_link && FirstPin(FirstRowOfStrip(mine.at), end) < end;
  uint levels = mine.is_solved ? cloth.strip_all_levels : cloth.strip_levels;
  // The pivot depends on particles on both sides, so its bound is lower than that of an elimination.
  precise float least = MIN_STRIP_PIVOT / float(1u << levels);
  if (mine.is_link && InverseMass(mine.to) == 0.0) least = MIN_STRIP_PIVOT_AT_PIN;
  uint most_levels = shared_has_pins != 0u ? cloth.strip_all_levels : cloth.strip_levels;
  for (uint level = 0u; level < most_levels; ++level) {
    uint stride = 1u << level;
    bool is_reduced = mine.is_link && level < levels;
    bool has_after = mine.at.row + stride < pin;
    StripRow before = NoRow();
    StripRow after = NoRow();
    if (is_reduced) {
      before = RowBefore(mine.at, stride);
      if (has_after) after = LoadRow(mine.at.row + stride);
    }
    PhaseBarrier();
    if (is_reduced) {
      ReducedRow reduced = ReduceRow(row, before, after, has_after, least);
      row = reduced.row;
      least = least * reduced.inverse_pivot;
      StoreRow(mine.at, row.before, row.after, row.right_side, row.excess);
    }
    PhaseBarrier();
  }
  if (mine.is_solved) {
    mine.impulse = row.right_side;
    if (pin < end && pin != mine.at.row) {
      precise float impulse = row.right_side - row.after * shared_rows[pin].z;
      mine.impulse = impulse;
    }
  } else if (mine.is_link) {
    shared_rows[mine.at.row].w = least;
  }
}

// One end of the elimination of a system.
struct HalfSystem {
  bool is_second;  // which goes backwards
  bool has_other;  // the other half has rows
  uint stride;     // between its rows
  uint row_count;  // 0: there is none, or nothing to do
  uint row;        // the last one
  float ratio;     // there: effect of the next impulse, over the pivot
  float impulse;   // of that link, at first without the other half [N s]
};

// `strip`: that of the system; `index` of the system in it.
HalfSystem HalfOf(LinkRow strip, uint index) {
  HalfSystem mine = HalfSystem(gl_LocalInvocationID.x % 2u == 1u, false, 1u << cloth.strip_levels, 0u, 0u, 0.0, 0.0);
  uint end = strip.row + strip.link_count;
  uint first = strip.row + index;
  // None, or nothing to do, or solved.
  if (first >= end || shared_rows[strip.row].x == 0.0 || FirstPin(strip.row, end) < end) return mine;
  uint rows = (end - first + mine.stride - 1u) >> cloth.strip_levels;
  // Of three rows at least, so that its last one is not the one with the flag.
  uint of_first = rows > 2u ? (rows + 1u) / 2u : rows;
  mine.has_other = of_first < rows;
  mine.row_count = mine.is_second ? rows - of_first : of_first;
  mine.row = first + mine.stride * (mine.is_second ? of_first : of_first - 1u);
  return mine;
}

// Eliminates the rows of a half up to the last one, and leaves there what the other half needs of it. Each pass reads
// the row of the next one: a single invocation waits for every result.
void EliminateRows(inout HalfSystem mine) {
  bool is_second = mine.is_second;
  uint step = is_second ? 0u - mine.stride : mine.stride;
  uint place = mine.row - step * (mine.row_count - 1u);
  uint first = place;
  float ratio = 0.0;
  float right_side = 0.0;
  precise float share = 0.0;  // the least pivot over the pivot
  vec4 row = shared_rows[place];
  for (uint left = mine.row_count; left > 0u; --left) {
    uint next_place = left > 1u ? place + step : place;
    vec4 next = shared_rows[next_place];
    float to_before = is_second ? row.y : row.x;
    float to_next = is_second ? row.x : row.y;
    if (place == first) to_before = 0.0;  // a flag, or nothing
    EliminatedRow eliminated = EliminateRow(to_before, to_next, row.z, row.w, ratio, right_side);
    ratio = eliminated.ratio;
    right_side = eliminated.right_side;
    share = row.w * eliminated.inverse_pivot;
    shared_rows[place].z = right_side;
    shared_rows[place].w = ratio;
    row = next;
    place = next_place;
  }
  mine.ratio = ratio;
  mine.impulse = right_side;
  if (!mine.has_other) return;
  if (is_second) {
    shared_rows[mine.row].y = share;
  } else {
    shared_rows[mine.row].x = share;
  }
}

// The impulse of the last link of a half, together with that of the other half [N s].
float MeetingImpulse(HalfSystem mine) {
  vec4 row = shared_rows[mine.row];
  vec4 other = shared_rows[mine.is_second ? mine.row - mine.stride : mine.row + mine.stride];
  precise float pivot = 1.0 - row.w * other.w;  // over that of either link
  float least = mine.is_second ? max(row.y, other.x) : max(row.x, other.y);
  float inverse_pivot = Reciprocal(max(pivot, least));
  precise float alone = row.z - row.w * other.z;
  precise float impulse = alone * inverse_pivot;
  return impulse;
}

// Replaces the right sides of the rows of a half by its impulses, from the last one back.
void SubstituteBack(HalfSystem mine) {
  uint step = mine.is_second ? mine.stride : 0u - mine.stride;
  uint place = mine.row;
  precise float impulse = mine.impulse;
  shared_rows[place].z = impulse;
  if (mine.row_count == 1u) return;
  place += step;
  vec4 row = shared_rows[place];
  for (uint left = mine.row_count - 1u; left > 0u; --left) {
    uint next_place = left > 1u ? place + step : place;
    vec4 next = shared_rows[next_place];
    impulse = row.z - row.w * impulse;
    shared_rows[place].z = impulse;
    row = next;
    place = next_place;
  }
}

// The changes of velocity of the particles of a link, its second one and, at the first link of a strip, its first one,
// by the pulls in the rows [m/s].
struct EndChanges {
  vec3 of_to;
  vec3 of_from;
};

EndChanges ChangesOfEnds(SideLink mine) {
  vec3 pull = RowVector(mine.at.row);
  vec3 pull_of_next = HasNext(mine.at) ? RowVector(mine.at.row + 1u) : vec3(0.0);
  precise vec3 of_to = InverseMass(mine.to) * (pull - pull_of_next);
  precise vec3 of_from = vec3(0.0);
  if (mine.at.k == 0u) of_from = InverseMass(mine.from) * -pull;
  return EndChanges(of_to, of_from);
}

void ChangeVelocity(uint i, vec3 change) {
  precise vec3 velocity = Velocity(i) + change;
  if (InverseMass(i) != 0.0) SetVelocity(i, velocity);
}

void ChangeEnds(SideLink mine, EndChanges changes) {
  ChangeVelocity(mine.to, changes.of_to);
  if (mine.at.k == 0u) ChangeVelocity(mine.from, changes.of_from);
}

void StorePull(SideLink mine, float share) {
  precise float applied = share * mine.impulse;
  AccumulateImpulse(mine.place, applied);
  precise vec3 pull = applied * mine.link.direction;
#ifdef HAS_IMPULSES
  PullAtStripLink(mine.place, mine.from, mine.to, pull);
#endif
  shared_rows[mine.at.row].y = pull.x;  // x may be the flag that others read
  shared_rows[mine.at.row].z = pull.y;
  shared_rows[mine.at.row].w = pull.z;
}

// The impulses moved particles too far, which is rare: takes back what is too much in each strip.
void RemoveExcess(SideLink mine) {
  float ratio_sq = 0.0;
  if (mine.is_active) {
    EndChanges changes = ChangesOfEnds(mine);
    ratio_sq = max(MoveRatioSq(changes.of_to, mine.link.rest_length),
                   MoveRatioSq(changes.of_from, mine.link.rest_length));
  }
  PhaseBarrier();
  if (mine.is_active) shared_rows[mine.at.row].x = ratio_sq;
  PhaseBarrier();
  precise float back = 0.0;
  if (mine.is_active) {
    float largest_ratio_sq = 0.0;
    for (uint k = 0u; k < mine.at.link_count; ++k) {
      largest_ratio_sq = max(largest_ratio_sq, shared_rows[FirstRowOfStrip(mine.at) + k].x);
    }
    back = ShareOfMove(largest_ratio_sq) - 1.0;
  }
  PhaseBarrier();
  if (back != 0.0) StorePull(mine, back);
  PhaseBarrier();
  if (back != 0.0) ChangeEnds(mine, ChangesOfEnds(mine));
}

// The strips [begin, end), a block. In uniform control flow.
void MeetStrips(uint begin, uint end, bool is_first_sweep) {
  uint lane = gl_LocalInvocationID.x;
  uint first_link = models[cloth.model.strip_offsets + begin];
  uint end_link = models[cloth.model.strip_offsets + end];
  LinkRow strip = LinkRow(0u, 0u, 0u);  // with the system of which this invocation eliminates a half
  uint system = lane / 2u;
  if (system < (end - begin) << cloth.strip_levels) {
    strip = LoadLinkRow(models[cloth.model.strip_offsets + begin + (system >> cloth.strip_levels)]);
  }
  SideLink mine = LoadSideLink(first_link + lane, end_link, is_first_sweep);
  if (mine.is_link) shared_rows[mine.at.row] = vec4(0.0, mine.link.direction);
  if (lane < (kRowPlaces + 31u) / 32u) shared_pins[lane] = 0u;
  if (lane == 0u) {
    shared_has_pins = 0u;
    shared_has_excess = 0u;
  }
  PhaseBarrier();
  vec2 effects = LoadNeighbours(mine);
  PhaseBarrier();
  StripRow row = RowOf(mine, effects);
  if (mine.is_link) {
    StoreRow(mine.at, row.before, row.after, row.right_side, row.excess);
    if (IsBeyondTolerance(mine.link)) shared_rows[FirstRowOfStrip(mine.at)].x = 1.0;  // all writers write the same
#ifdef HAS_PINS
    if (InverseMass(mine.to) == 0.0) FlagPin(mine.at.row);
#endif
  }
  PhaseBarrier();
  ReduceRows(mine, row);
  PhaseBarrier();

  HalfSystem half_system = HalfOf(strip, system & ((1u << cloth.strip_levels) - 1u));
  if (half_system.row_count > 0u) EliminateRows(half_system);
  PhaseBarrier();
  if (half_system.has_other && half_system.row_count > 0u) half_system.impulse = MeetingImpulse(half_system);
  PhaseBarrier();
  if (half_system.row_count > 0u) SubstituteBack(half_system);
  PhaseBarrier();

  if (mine.is_link) {
    mine.is_active = shared_rows[FirstRowOfStrip(mine.at)].x != 0.0;
    if (!mine.is_solved) mine.impulse = shared_rows[mine.at.row].z;
  }
  if (mine.is_active) StorePull(mine, 1.0);
  PhaseBarrier();
  if (mine.is_active) {
    MarkChanged();
    EndChanges changes = ChangesOfEnds(mine);
    ChangeEnds(mine, changes);
    bool moves_far =
        MovesFar(changes.of_to, mine.link.rest_length) || MovesFar(changes.of_from, mine.link.rest_length);
    if (moves_far) shared_has_excess = 1u;  // all writers write the same
  }
  PhaseBarrier();
  if (shared_has_excess != 0u) RemoveExcess(mine);
}
