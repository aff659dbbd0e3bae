#include "server/solver/gl_compute/self_contact_words.h"

#include <algorithm>
#include <cstddef>

#include "server/solver/gl_compute/packing.h"

namespace drape {

namespace {

uint32_t Position(const std::vector<uint32_t>& words) {
  return static_cast<uint32_t>(words.size());
}

// The tree in the order of a walk, and its nodes that are no leaves by depth.
class WalkedTree {
 public:
  WalkedTree(const ContactSurface& surface, std::vector<uint32_t>& words)
      : surface_(surface), words_(words) {
    for (const ContactPatch& patch : surface.patches()) {
      triangle_begins_.push_back(triangles_);
      triangles_ += patch.triangle_end - patch.triangle_begin;
      edge_begins_.push_back(edges_);
      edges_ += patch.edge_end - patch.edge_begin;
      corner_begins_.push_back(corners_);
      corners_ += patch.corner_end - patch.corner_begin;
    }
    if (!surface.nodes().empty()) Walk(0, 0);
  }

  uint32_t node_count() const { return node_count_; }
  // [depth] nodes that are no leaves.
  const std::vector<std::vector<uint32_t>>& levels() const { return levels_; }

 private:
  // As deep as the logarithm of the number of patches.
  void Walk(uint32_t node, size_t depth) {
    const uint32_t place = node_count_++;
    const size_t word = words_.size();
    words_.resize(word + DRAPE_CONTACT_NODE_WORDS, 0);
    const ContactNode& its = surface_.nodes()[node];
    if (its.first_child == 0) {
      const uint32_t p = its.patch;
      const ContactPatch& patch = surface_.patches()[p];
      words_[word + 1] = triangle_begins_[p];
      words_[word + 2] = triangle_begins_[p] + patch.triangle_end - patch.triangle_begin;
      words_[word + 3] = edge_begins_[p];
      words_[word + 4] = edge_begins_[p] + patch.edge_end - patch.edge_begin;
      words_[word + 5] = corner_begins_[p];
      words_[word + 6] = corner_begins_[p] + patch.corner_end - patch.corner_begin;
    } else {
      if (levels_.size() <= depth) levels_.resize(depth + 1);
      levels_[depth].push_back(place);
      Walk(its.first_child, depth + 1);
      Walk(its.first_child + 1, depth + 1);
    }
    words_[word] = node_count_;
  }

  const ContactSurface& surface_;
  std::vector<uint32_t>& words_;
  uint32_t node_count_ = 0, triangles_ = 0, edges_ = 0, corners_ = 0;
  std::vector<uint32_t> triangle_begins_, edge_begins_, corner_begins_;
  std::vector<std::vector<uint32_t>> levels_;
};

void PackNeighbours(const ContactSurface& surface, shader::SelfContactRecord& record,
                    std::vector<uint32_t>& words) {
  std::vector<std::vector<uint32_t>> neighbours(surface.particle_count());
  for (const auto& [i, j] : surface.edges()) {
    neighbours[i].push_back(j);
    neighbours[j].push_back(i);
  }
  record.neighbour_offsets = Position(words);
  uint32_t offset = 0;
  for (const std::vector<uint32_t>& its : neighbours) {
    words.push_back(offset);
    offset += static_cast<uint32_t>(its.size());
  }
  words.push_back(offset);
  record.neighbours = Position(words);
  for (const std::vector<uint32_t>& its : neighbours) {
    words.insert(words.end(), its.begin(), its.end());
  }
}

// The other two corners of each triangle at a particle.
void PackCornersAround(const ContactSurface& surface, shader::SelfContactRecord& record,
                       std::vector<uint32_t>& words) {
  record.around_offsets = Position(words);
  uint32_t offset = 0;
  for (uint32_t i = 0; i < surface.particle_count(); ++i) {
    words.push_back(offset);
    const auto count = static_cast<uint32_t>(surface.corners_around(i).size());
    offset += count;
    record.most_around = std::max(record.most_around, count);
  }
  words.push_back(offset);
  record.corners_around = Position(words);
  for (uint32_t i = 0; i < surface.particle_count(); ++i) {
    for (const auto& others : surface.corners_around(i)) {
      words.insert(words.end(), others.begin(), others.end());
    }
  }
}

}  // namespace

static_assert(offsetof(shader::SelfContactRecord, capacity) ==
              DRAPE_CONTACT_CAPACITY * sizeof(uint32_t));
static_assert(offsetof(shader::SelfContactRecord, may_grow) ==
              DRAPE_CONTACT_MAY_GROW * sizeof(uint32_t));

shader::SelfContactRecord PackSurface(const ContactSurface& surface, std::vector<uint32_t>& words) {
  shader::SelfContactRecord record{};
  record.rest_positions = Position(words);
  for (const self_contact::Vector3d& p : surface.rest_positions()) {
    words.insert(words.end(), {FloatWord(p[0]), FloatWord(p[1]), FloatWord(p[2])});
  }
  record.vertices = Position(words);
  words.insert(words.end(), surface.patch_vertices().begin(), surface.patch_vertices().end());
  record.vertex_count = static_cast<uint32_t>(surface.patch_vertices().size());
  record.edges = Position(words);
  for (const uint32_t e : surface.patch_edges()) {
    words.insert(words.end(), surface.edges()[e].begin(), surface.edges()[e].end());
  }
  record.edge_count = static_cast<uint32_t>(surface.patch_edges().size());
  record.triangles = Position(words);
  for (const uint32_t t : surface.patch_triangles()) {
    words.insert(words.end(), surface.triangles()[t].begin(), surface.triangles()[t].end());
  }
  record.corners = Position(words);
  for (const ContactPatch& patch : surface.patches()) {
    const std::span<const uint32_t> corners = surface.corners_of(patch);
    words.insert(words.end(), corners.begin(), corners.end());
  }
  record.nodes = Position(words);
  const WalkedTree tree(surface, words);
  record.node_count = tree.node_count();
  record.levels = Position(words);
  record.level_count = static_cast<uint32_t>(tree.levels().size());
  uint32_t offset = 0;
  for (size_t level = tree.levels().size(); level-- > 0;) {
    words.push_back(offset);
    offset += static_cast<uint32_t>(tree.levels()[level].size());
  }
  words.push_back(offset);
  record.level_nodes = Position(words);
  for (size_t level = tree.levels().size(); level-- > 0;) {
    words.insert(words.end(), tree.levels()[level].begin(), tree.levels()[level].end());
  }
  PackNeighbours(surface, record, words);
  PackCornersAround(surface, record, words);
  return record;
}

uint64_t LayOutSelfContacts(uint64_t size, uint32_t particle_count, uint32_t capacity,
                            shader::SelfContactRecord& record) {
  const auto append = [&size](uint64_t words) {
    const uint64_t begin = size;
    size += words;
    return static_cast<uint32_t>(begin);
  };
  const uint64_t particles = particle_count;
  record.capacity = capacity;
  record.state = append(DRAPE_CONTACT_STATE_WORDS);
  record.starts = append(3 * particles);
  record.found_positions = append(3 * particles);
  record.found_velocities = append(3 * particles);
  record.boxes = append(uint64_t{DRAPE_CONTACT_BOX_WORDS} * record.node_count);
  record.places = append(uint64_t{record.vertex_count} + record.edge_count);
  record.claims = append(particles);
  record.zones = append(particles);
  record.wanted = append(3 * particles);
  record.shares = append(particles);
  record.pin_pushes = append(3 * particles);
  record.sums = append(DRAPE_CONTACT_SUM_WORDS * particles);
  record.pairs = append(uint64_t{DRAPE_CONTACT_PAIR_WORDS} * capacity);
  record.pending = append(capacity);
  record.order = append(capacity);
  record.turns = append(DRAPE_CONTACT_TURNS);
  return size;
}

shader::SelfContactRecord PlacedSelfContacts(const shader::SelfContactRecord& record,
                                             const SelfContactPlaces& places,
                                             const ClothParameters& parameters,
                                             double edge_length_m) {
  using Record = shader::SelfContactRecord;
  Record placed = record;
  const SelfContactNumbers numbers = SelfContactOf(parameters);
  placed.thickness = static_cast<float>(numbers.thickness_m);
  placed.friction_static = static_cast<float>(numbers.friction_static);
  placed.friction_dynamic = static_cast<float>(numbers.friction_dynamic);
  placed.edge_length = static_cast<float>(edge_length_m);
  placed.gravity = static_cast<float>(parameters.gravity_m_per_s2.norm());
  for (uint32_t Record::*const place :
       {&Record::rest_positions, &Record::vertices, &Record::edges, &Record::triangles,
        &Record::nodes, &Record::levels, &Record::level_nodes, &Record::corners,
        &Record::neighbour_offsets, &Record::neighbours, &Record::around_offsets,
        &Record::corners_around}) {
    placed.*place += places.models;
  }
  placed.crossing_flags = places.parameters + kSelfContactRecordWords;
  for (uint32_t Record::*const place :
       {&Record::state, &Record::starts, &Record::found_positions, &Record::found_velocities,
        &Record::boxes, &Record::places, &Record::claims, &Record::zones, &Record::wanted,
        &Record::shares, &Record::pin_pushes, &Record::sums, &Record::pairs, &Record::pending,
        &Record::order, &Record::turns}) {
    placed.*place += places.scratch;
  }
  return placed;
}

}  // namespace drape
