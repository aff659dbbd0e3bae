// Stage find_self_contacts, the search: which pairs may come near each other within some time. Its result holds as
// long as no particle is farther than `drift` from where its velocity takes it, relative to any other.
#include "interface/self_contact_search.h"
#include "stages/self_contacts.glsl"

const float kMost = 3.4028235e38;

// A search that finds more pairs than so many per particle is for less time instead, down to one substep.
const uint kManyPairs = 24u;

float search_seconds = 0.0;  // of the search under way

vec3 FoundPosition(uint i) { return ScratchVector(contact.found_positions + 3u * i); }
vec3 FoundVelocity(uint i) { return ScratchVector(contact.found_velocities + 3u * i); }
void SetFound(uint i, vec3 p, vec3 v) {
  SetScratchVector(contact.found_positions + 3u * i, p);
  SetScratchVector(contact.found_velocities + 3u * i, v);
}

// Of the vectors that an invocation has seen.
struct Range {
  vec3 low, high;
};

Range NoRange() { return Range(vec3(kMost), vec3(-kMost)); }
void AddVector(inout Range range, vec3 v) { range = Range(min(range.low, v), max(range.high, v)); }
// Of the vectors that all have seen. In uniform control flow.
float LargestDifferenceOf(Range range) {
  OfferRange(range.low, range.high);
  EndOffers();
  return LargestDifference();
}

// Of positions, then of velocities.
struct MotionBox {
  vec3 low, high, slowest, fastest;
};

MotionBox NoBox() {
  return MotionBox(vec3(kMost), vec3(-kMost), vec3(kMost), vec3(-kMost));
}
void AddParticle(inout MotionBox box, uint i) {
  vec3 p = FoundPosition(i);
  vec3 v = FoundVelocity(i);
  box = MotionBox(min(box.low, p), max(box.high, p), min(box.slowest, v), max(box.fastest, v));
}
MotionBox LoadBox(uint node) {
  uint word = contact.boxes + DRAPE_CONTACT_BOX_WORDS * node;
  return MotionBox(ScratchVector(word), ScratchVector(word + 3u), ScratchVector(word + 6u), ScratchVector(word + 9u));
}
void StoreBox(uint node, MotionBox box) {
  uint word = contact.boxes + DRAPE_CONTACT_BOX_WORDS * node;
  SetScratchVector(word, box.low);
  SetScratchVector(word + 3u, box.high);
  SetScratchVector(word + 6u, box.slowest);
  SetScratchVector(word + 9u, box.fastest);
}

uint NodeWord(uint node, uint field) { return models[contact.nodes + DRAPE_CONTACT_NODE_WORDS * node + field]; }

// The boxes of the leaves, then those above them, level by level.
void FitBoxes() {
  CountLoop(contact.node_count);
  FOR_EACH(node, 0u, contact.node_count) {
    uint begin = NodeWord(node, 5u);
    uint end = NodeWord(node, 6u);
    MotionBox box = NoBox();
    for (uint k = begin; k < end; ++k) AddParticle(box, models[contact.corners + k]);
    if (end > begin) StoreBox(node, box);
  }
  // A patch of eight triangles has at most 24 corners.
  used_passes += 26u * (contact.node_count / uint(LOCAL_SIZE) + 1u);
  EndPhase();
  for (uint level = 0u; level < contact.level_count; ++level) {
    uint begin = models[contact.levels + level];
    uint end = models[contact.levels + level + 1u];
    CountLoop(end - begin);
    FOR_EACH(k, begin, end) {
      uint node = models[contact.level_nodes + k];
      MotionBox a = LoadBox(node + 1u);
      MotionBox b = LoadBox(NodeWord(node + 1u, 0u));
      StoreBox(node, MotionBox(min(a.low, b.low), max(a.high, b.high), min(a.slowest, b.slowest),
                               max(a.fastest, b.fastest)));
    }
    EndPhase();
  }
}

bool MayMeet(MotionBox a, MotionBox b, float reach) {
  precise vec3 faster = abs(a.fastest - b.slowest);
  precise vec3 slower = abs(a.slowest - b.fastest);
  precise vec3 margin = reach + search_seconds * max(faster, slower);
  precise vec3 above = a.low - b.high;
  precise vec3 below = b.low - a.high;
  return !any(greaterThan(max(above, below), margin));
}

uvec2 EdgeAt(uint e) { return uvec2(models[contact.edges + 2u * e], models[contact.edges + 2u * e + 1u]); }
uvec3 TriangleAt(uint t) {
  uint word = contact.triangles + 3u * t;
  return uvec3(models[word], models[word + 1u], models[word + 2u]);
}

vec3 RestPosition(uint i) {
  uint word = contact.rest_positions + 3u * i;
  return vec3(ModelFloat(word), ModelFloat(word + 1u), ModelFloat(word + 2u));
}
Corners RestCorners(uvec4 i) {
  return Corners(RestPosition(i.x), RestPosition(i.y), RestPosition(i.z), RestPosition(i.w));
}

// The distance at which pairs touch that are far from each other at rest [m].
float TouchOfKind(bool are_edges) {
  precise float of_kind = are_edges ? EDGE_SHARE * contact.thickness : contact.thickness;
  return of_kind;
}

// The distance at which a pair touches [m] (method.md, equation 49).
float TouchOf(bool are_edges, uvec4 i) {
  float of_kind = TouchOfKind(are_edges);
  float rest = Length(Closest(are_edges, RestCorners(i)).difference);
  precise float of_rest = REST_SHARE * rest;
  return rest < contact.thickness ? min(of_kind, of_rest) : of_kind;
}

// Whether a pair may come nearer than the thickness within the time of the search.
bool IsFound(bool are_edges, uvec4 i) {
  bool has_common = i.x == i.z || i.x == i.w || (are_edges ? i.y == i.z || i.y == i.w : i.x == i.y);
  if (has_common) return false;
  Corners p = Corners(FoundPosition(i.x), FoundPosition(i.y), FoundPosition(i.z), FoundPosition(i.w));
  Corners v = Corners(FoundVelocity(i.x), FoundVelocity(i.y), FoundVelocity(i.z), FoundVelocity(i.w));
  precise float farthest = TouchOfKind(are_edges) + (drift + search_seconds * Length(LargestDifferences(are_edges, v)));
  return BoxGap(are_edges, p) <= farthest && Length(Closest(are_edges, p).difference) <= farthest;
}

bool IsLeftAlone(uvec4 i) {
  if (contact.has_crossings == 0u) return false;
  return (parameters[contact.crossing_flags + i.x] & parameters[contact.crossing_flags + i.y] &
          parameters[contact.crossing_flags + i.z] & parameters[contact.crossing_flags + i.w]) != 0u;
}

void StorePair(uint k, bool are_edges, uvec4 i) {
  scratch_words[PairWord(0u, k)] = i.x;
  scratch_words[PairWord(1u, k)] = i.y;
  scratch_words[PairWord(2u, k)] = i.z;
  scratch_words[PairWord(3u, k)] = i.w;
  SetPairFlags(k, (are_edges ? kAreEdges : 0u) | (IsLeftAlone(i) ? kLeftAlone : 0u));
}

// A walk over the tree for each vertex and each edge: against the triangles, and against the edges behind it in the
// list. One loop, whose every pass is a node or a primitive, so that invocations side by side do not wait for each
// other at each of them. Without `is_writing`, counts the pairs of each; with it stores them from where they belong.
// The largest number of passes.
uint Walk(bool is_writing) {
  uint sources = contact.vertex_count + contact.edge_count;
  uint source = gl_LocalInvocationID.x;
  bool has_begun = false;
  bool are_edges = false;
  uvec2 own = uvec2(0u);
  MotionBox own_box = NoBox();
  uint node = 0u;
  uint cursor = 0u;
  uint cursor_end = 0u;
  uint place = 0u;
  uint passes = 0u;
  precise float reach = contact.thickness + drift;
  while (source < sources && passes < CONTACT_LOOP_BUDGET / 8u) {
    ++passes;
    if (!has_begun) {
      has_begun = true;
      are_edges = source >= contact.vertex_count;
      own = are_edges ? EdgeAt(source - contact.vertex_count) : uvec2(models[contact.vertices + source]);
      own_box = NoBox();
      AddParticle(own_box, own.x);
      AddParticle(own_box, own.y);
      node = 0u;
      cursor = cursor_end = 0u;
      place = is_writing ? scratch_words[contact.places + source] : 0u;
    } else if (cursor < cursor_end) {
      uvec2 edge = are_edges ? EdgeAt(cursor) : uvec2(0u);
      uvec3 corners = are_edges ? uvec3(own.y, edge.x, edge.y) : TriangleAt(cursor);
      uvec4 particles = uvec4(own.x, corners.x, corners.y, corners.z);
      if (IsFound(are_edges, particles)) {
        if (is_writing) StorePair(place, are_edges, particles);
        ++place;
      }
      ++cursor;
    } else if (node < contact.node_count) {
      uint skip = NodeWord(node, 0u);
      if (!MayMeet(own_box, LoadBox(node), reach)) {
        node = skip;
      } else if (skip == node + 1u) {
        uint field = are_edges ? 3u : 1u;
        cursor = NodeWord(node, field);
        cursor_end = NodeWord(node, field + 1u);
        if (are_edges) cursor = max(cursor, source - contact.vertex_count + 1u);
        node = skip;
      } else {
        ++node;
      }
    } else {
      if (!is_writing) scratch_words[contact.places + source] = place;
      source += LOCAL_SIZE;
      has_begun = false;
    }
  }
  return source < sources ? kNone : passes;
}

shared uint shared_sums[LOCAL_SIZE];

// From numbers of pairs to where those of each begin, from `first` on. The number of all.
uint PlacePairs(uint first) {
  uint sources = contact.vertex_count + contact.edge_count;
  uint chunk = (sources + uint(LOCAL_SIZE) - 1u) / uint(LOCAL_SIZE);
  uint begin = min(gl_LocalInvocationID.x * chunk, sources);
  uint end = min(begin + chunk, sources);
  uint sum = 0u;
  for (uint s = begin; s < end; ++s) sum += scratch_words[contact.places + s];
  shared_sums[gl_LocalInvocationID.x] = sum;
  EndPhase();
  uint place = first;
  uint total = 0u;
  for (uint lane = 0u; lane < uint(LOCAL_SIZE); ++lane) {
    if (lane == gl_LocalInvocationID.x) place += total;
    total += shared_sums[lane];
  }
  for (uint s = begin; s < end; ++s) {
    uint count = scratch_words[contact.places + s];
    scratch_words[contact.places + s] = place;
    place += count;
  }
  used_passes += 2u * chunk + uint(LOCAL_SIZE) + 9u;
  EndPhase();
  return total;
}

// The drift that a search for so many seconds allows for [m].
float DriftFor(float seconds) {
  precise float allowed = drift_scale * (DRAPE_CONTACT_DRIFT_THICKNESS * contact.thickness +
                                         DRAPE_CONTACT_DRIFT_EDGE * contact.edge_length +
                                         0.5 * DRAPE_CONTACT_DRIFT_FALL * contact.gravity * seconds * seconds);
  return allowed;
}

// The pairs behind the first `kept` ones are those of found_positions and found_velocities, if there are no more than
// `most`. In uniform control flow.
void SearchPairs(uint kept, float seconds, uint most) {
  search_seconds = seconds;
  FitBoxes();
  pair_count = kept;
  has_all_pairs = true;
  // Counts, then writes; a loop, so that compilers have the walk once.
  for (uint pass = 0u; pass < 2u && has_all_pairs; ++pass) {
    uint passes = Walk(pass == 1u);
    OfferBits(0u, min(passes, CONTACT_LOOP_BUDGET / 8u));
    if (passes == kNone) OfferBits(1u, 1u);
    EndOffers();
    used_passes += Largest(0u) + 3u;
    has_all_pairs = Largest(1u) == 0u;
    if (pass == 1u || !has_all_pairs) continue;
    uint found = PlacePairs(kept);
    uint total = kept + found;
    if (gl_LocalInvocationID.x == 0u && found <= most) {
      statuses[status_index].contact_pairs = max(statuses[status_index].contact_pairs, total);
    }
    has_all_pairs = found <= most && total <= contact.capacity;
    if (has_all_pairs) pair_count = total;
  }
  CountLoop(pair_count - kept);
  FOR_EACH(k, kept, pair_count) {
    SetPairNumber(kTouchField, k, TouchOf((PairFlags(k) & kAreEdges) != 0u, PairParticles(k)));
  }
  EndPhase();
}

// Relative to the mean over its neighbours: those that flutter against each other stay where they are.
vec3 SmoothedVelocity(uint i) {
  uint begin = models[contact.neighbour_offsets + i];
  uint end = models[contact.neighbour_offsets + i + 1u];
  precise vec3 sum = Velocity(i);
  for (uint k = begin; k < end; ++k) sum += Velocity(models[contact.neighbours + k]);
  return Quotient(sum, float(1u + end - begin));
}

// For the substeps that come, from the start of this one.
void SearchAhead(uint substeps_of_step) {
  Range velocities = NoRange();
  CountLoop(16u * cloth.particle_count);  // most particles have fewer neighbours
  FOR_EACH(i, 0u, cloth.particle_count) {
    vec3 v = SmoothedVelocity(i);
    SetFound(i, Position(i), v);
    AddVector(velocities, v);
  }
  precise float speed = 0.5 * LargestDifferenceOf(velocities);
  precise float edge_way = DRAPE_CONTACT_SEARCH_WAY * contact.edge_length;
  float longest = min(DRAPE_CONTACT_LONGEST_SEARCH, Quotient(edge_way, max(speed, 1e-30)));
  substeps_left = max(1u, uint(min(Quotient(longest, cloth.step.h), float(substeps_of_step))));
  since_search = 0u;
  while (true) {
    precise float seconds = float(substeps_left) * cloth.step.h;
    drift = DriftFor(seconds);
    SearchPairs(0u, seconds, substeps_left == 1u ? kNone : kManyPairs * cloth.particle_count);
    if (has_all_pairs || substeps_left == 1u || IsOutOfPasses()) return;
    substeps_left = max(substeps_left / 4u, 1u);
  }
}

// For this substep alone, by the ways that its particles take. Adds to the pairs that are known: those may be there
// twice then.
void SearchWays() {
  Range ways = NoRange();
  CountLoop(cloth.particle_count);
  FOR_EACH(i, 0u, cloth.particle_count) {
    precise vec3 way = Position(i) - Start(i);
    precise vec3 v = way * cloth.step.inverse_h;
    SetFound(i, Start(i), v);
    AddVector(ways, way);
  }
  since_search = 0u;
  substeps_left = 0u;
  // What the guard stops stays within the range of the ways.
  drift = max(DriftFor(cloth.step.h), LargestDifferenceOf(ways));
  SearchPairs(pair_count, cloth.step.h, kNone);
}
