#include "server/solver/gl_compute/device_model.h"

#include <algorithm>
#include <bit>

#include "server/solver/gl_compute/kernel_variant.h"
#include "server/solver/gl_compute/packing.h"
#include "server/solver/gl_compute/regular_strips.h"
#include "server/solver/gl_compute/self_contact_words.h"
#include "server/solver/gl_compute/strip_lanes.h"
#include "shaders/interface/bindings.h"

namespace drape {

namespace {

uint32_t Position(const std::vector<uint32_t>& words) {
  return static_cast<uint32_t>(words.size());
}

uint32_t KindWord(ConstraintKind kind) {
  switch (kind) {
    case ConstraintKind::kAtMost:
      return DRAPE_KIND_AT_MOST;
    case ConstraintKind::kAtLeast:
      return DRAPE_KIND_AT_LEAST;
    case ConstraintKind::kEqual:
      break;
  }
  return DRAPE_KIND_EQUAL;
}

uint32_t KindWord(ElasticKind kind) {
  switch (kind) {
    case ElasticKind::kCells:
      return DRAPE_ELASTIC_CELLS;
    case ElasticKind::kDiagonals:
      return DRAPE_ELASTIC_DIAGONALS;
    case ElasticKind::kRods:
      break;
  }
  return DRAPE_ELASTIC_RODS;
}

void AppendPair(uint32_t i, uint32_t j, bool is_resident, std::vector<uint32_t>& words) {
  if (is_resident) {
    words.push_back(i | j << 16);
  } else {
    words.insert(words.end(), {i, j});
  }
}

void PackConstraints(const SceneModel& model, bool is_resident, PackedModel& packed) {
  std::vector<uint32_t>& words = packed.words;
  packed.layout.colour_offsets = Position(words);
  words.insert(words.end(), model.colour_offsets().begin(), model.colour_offsets().end());
  packed.layout.pairs = Position(words);
  for (const DistanceConstraint& constraint : model.constraints()) {
    AppendPair(constraint.i, constraint.j, is_resident, words);
  }
  packed.layout.rest_lengths = Position(words);
  for (const DistanceConstraint& constraint : model.constraints()) {
    words.push_back(FloatWord(constraint.rest_length_m));
  }
  if (model.has_compliance()) {
    packed.layout.compliances = Position(words);
    for (const DistanceConstraint& constraint : model.constraints()) {
      words.push_back(FloatWord(constraint.compliance_m_per_n));
    }
  }
  if (model.has_inequalities()) {
    packed.layout.kinds = Position(words);
    for (const DistanceConstraint& constraint : model.constraints()) {
      words.push_back(KindWord(constraint.kind));
    }
  }
}

void PackJoints(const SceneModel& model, PackedModel& packed) {
  if (model.joint_count() == 0) return;
  std::vector<uint32_t>& words = packed.words;
  packed.layout.joint_colour_offsets = Position(words);
  words.insert(words.end(), model.joint_colour_offsets().begin(),
               model.joint_colour_offsets().end());
  packed.layout.joint_pairs = Position(words);
  for (const PointJoint& joint : model.joints()) {
    words.push_back(joint.i);
    words.push_back(joint.j);
  }
  if (!model.has_joint_compliance()) return;
  packed.layout.joint_compliances = Position(words);
  for (const PointJoint& joint : model.joints()) {
    words.push_back(FloatWord(joint.compliance_m_per_n));
  }
}

// [colour_count] from where each colour begins.
std::vector<uint32_t> SizesOf(std::span<const uint32_t> offsets) {
  std::vector<uint32_t> sizes;
  for (size_t c = 0; c + 1 < offsets.size(); ++c) sizes.push_back(offsets[c + 1] - offsets[c]);
  return sizes;
}

void PackSprings(const SceneModel& model, PackedModel& packed) {
  if (model.spring_count() == 0) return;
  std::vector<uint32_t>& words = packed.words;
  packed.layout.spring_offsets = Position(words);
  words.insert(words.end(), model.spring_offsets().begin(), model.spring_offsets().end());
  packed.layout.spring_ends = Position(words);
  for (const SpringEnd& end : model.spring_ends()) {
    words.push_back(end.other_particle);
    words.push_back(FloatWord(end.rest_length_m));
    words.push_back(FloatWord(end.stiffness_n_per_m));
    words.push_back(FloatWord(end.damping_n_s_per_m));
  }
}

void PackElastic(const SceneModel& model, PackedModel& packed) {
  if (model.elastic_count() == 0) return;
  std::vector<uint32_t>& words = packed.words;
  const ElasticShares& shares = model.elastic_shares();
  packed.layout.elastic_elements = Position(words);
  for (uint32_t e = 0; e < model.elastic_count(); ++e) {
    const ElasticElement& element = model.elastic_elements()[e];
    words.insert(words.end(), element.particles.begin(), element.particles.end());
    for (size_t k = 1; k < 4; ++k) words.push_back(FloatWord(element.weights[k]));
    words.push_back(FloatWord(element.rest_length_m));
    words.push_back(FloatWord(shares.masses_kg[e]));
    words.push_back(FloatWord(shares.frequencies_sq_per_s2[e]));
    words.push_back(FloatWord(element.damping_share));
  }
  packed.layout.elastic_offsets = Position(words);
  words.insert(words.end(), shares.offsets.begin(), shares.offsets.end());
  packed.layout.elastic_ends = Position(words);
  for (const ElasticEnd& end : shares.ends) {
    words.push_back(end.impulse);
    words.push_back(FloatWord(end.weight));
  }
  const ElasticLines& lines = model.elastic_lines();
  packed.layout.elastic_families = Position(words);
  for (const ElasticFamily& family : lines.families) {
    words.insert(words.end(), {KindWord(family.kind), FloatWord(family.rest_length_m),
                               family.line_begin, family.line_end});
  }
  packed.layout.elastic_lines = Position(words);
  for (const ElasticLine& line : lines.lines) {
    words.insert(words.end(), {line.first, line.stride, line.count, line.entry_begin});
  }
}

void PackTethers(const SceneModel& model, PackedModel& packed) {
  if (model.tethers().empty()) return;
  std::vector<uint32_t>& words = packed.words;
  packed.layout.tether_offsets = Position(words);
  words.insert(words.end(), model.tether_offsets().begin(), model.tether_offsets().end());
  packed.layout.tethers = Position(words);
  for (const Tether& tether : model.tethers()) {
    words.push_back(tether.pin);
    words.push_back(FloatWord(tether.length_m));
  }
}

// What kernels that solve strips by work groups or lanes know of their links.
void PackStripRows(const SceneModel& model, bool is_resident, PackedModel& packed) {
  const StripSet& strips = model.strips();
  std::vector<uint32_t>& words = packed.words;
  const auto append = [&words](const std::vector<uint32_t>& values) {
    const uint32_t begin = Position(words);
    words.insert(words.end(), values.begin(), values.end());
    return begin;
  };
  packed.layout.strip_ends = Position(words);
  for (uint32_t s = 0; s < strips.strip_count(); ++s) {
    for (uint32_t k = strips.strip_offsets[s]; k < strips.strip_offsets[s + 1]; ++k) {
      AppendPair(strips.particles[k + s], strips.particles[k + s + 1], is_resident, words);
    }
  }
  packed.rows = FindStripRows(model, is_resident);
  packed.layout.strip_rows = append(packed.rows.rows);
  packed.layout.strip_phase_blocks = append(packed.rows.phase_blocks);
  packed.layout.strip_blocks = append(packed.rows.block_strips);
  if (!is_resident || !FitsInLanes(model)) return;
  const StripLanes lanes = FindStripLanes(model);
  packed.layout.strip_phase_lanes = append(lanes.phase_lanes);
  packed.layout.strip_lanes = append(lanes.words);
}

void PackStrips(const SceneModel& model, PackedModel& packed) {
  const StripSet& strips = model.strips();
  const auto append = [&packed](const std::vector<uint32_t>& values) {
    const uint32_t begin = Position(packed.words);
    packed.words.insert(packed.words.end(), values.begin(), values.end());
    return begin;
  };
  packed.layout.strip_phases = append(strips.phase_offsets);
  packed.layout.strip_offsets = append(strips.strip_offsets);
  packed.layout.strip_constraints = append(strips.constraints);
  packed.layout.strip_particles = append(strips.particles);
  std::vector<uint32_t>& words = packed.words;
  packed.layout.strip_lengths = Position(words);
  for (const uint32_t constraint : strips.constraints) {
    words.push_back(FloatWord(model.constraints()[constraint].rest_length_m));
  }
  packed.layout.strip_spans = Position(words);
  for (uint32_t s = 0; s < strips.strip_count() && model.has_spans(); ++s) {
    const uint32_t links = strips.strip_offsets[s + 1] - strips.strip_offsets[s];
    words.insert(words.end(), links, FloatWord(model.IsSpan(s) ? 1 : 0));
  }
  packed.layout.regular_strips = Position(words);
  for (const RegularStrip& strip : FindRegularStrips(model)) {
    words.insert(words.end(), {strip.link_begin, strip.link_end, strip.first_particle, strip.stride,
                               std::bit_cast<uint32_t>(strip.rest_length_m)});
  }
}

void PackTriangles(const SceneModel& model, PackedModel& packed) {
  std::vector<uint32_t>& words = packed.words;
  packed.layout.triangles = Position(words);
  for (const auto& corners : model.triangles()) {
    words.insert(words.end(), corners.begin(), corners.end());
  }
  packed.layout.triangle_masses = Position(words);
  for (const double mass : model.triangle_masses_kg()) words.push_back(FloatWord(mass));
  packed.layout.corner_shares = Position(words);
  for (const double share : model.corner_shares()) words.push_back(FloatWord(share));
  packed.layout.triangle_offsets = Position(words);
  words.insert(words.end(), model.triangle_offsets().begin(), model.triangle_offsets().end());
  packed.layout.particle_triangles = Position(words);
  words.insert(words.end(), model.particle_triangles().begin(), model.particle_triangles().end());
}

}  // namespace

PackedModel PackModel(const SceneModel& model, const ModelUse& use) {
  PackedModel packed;
  const bool is_resident = IsResident(model, use.surface != nullptr);
  PackConstraints(model, is_resident, packed);
  PackJoints(model, packed);
  packed.layout.masses = Position(packed.words);
  for (const double mass : model.masses_kg()) packed.words.push_back(FloatWord(mass));
  packed.layout.inverse_masses = Position(packed.words);
  for (const double w : model.inverse_masses_per_kg()) packed.words.push_back(FloatWord(w));
  PackSprings(model, packed);
  PackElastic(model, packed);
  packed.layout.pins = Position(packed.words);
  packed.words.insert(packed.words.end(), model.pins().begin(), model.pins().end());
  PackTethers(model, packed);
  PackStrips(model, packed);
  if (use.has_strip_rows) PackStripRows(model, is_resident, packed);
  if (use.has_air_forces) PackTriangles(model, packed);
  if (use.surface != nullptr) packed.contacts = PackSurface(*use.surface, packed.words);
  return packed;
}

Result<std::shared_ptr<const DeviceModel>> ModelStore::Acquire(
    std::shared_ptr<const SceneModel> model, const ModelUse& use) {
  const std::tuple key(static_cast<const SceneModel*>(model.get()), use.has_air_forces,
                       use.has_strip_rows, use.surface != nullptr);
  const auto known = models_.find(key);
  if (known != models_.end()) {
    if (std::shared_ptr<const DeviceModel> on_device = known->second.lock()) return on_device;
  }
  std::erase_if(models_, [](const auto& entry) { return entry.second.expired(); });
  PackedModel packed = PackModel(*model, use);
  Result<WordRange> range = arena_->Allocate(packed.words.size());
  if (!range.ok()) return range.status();
  auto on_device = std::make_shared<DeviceModel>();
  on_device->layout = packed.layout;
  on_device->contacts = packed.contacts;
  on_device->surface = use.surface;
  on_device->words = std::move(range).value();
  arena_->Write(on_device->words, 0, std::span<const uint32_t>(packed.words));
  on_device->colour_sizes = SizesOf(model->colour_offsets());
  on_device->joint_colour_sizes = SizesOf(model->joint_colour_offsets());
  on_device->phase_sizes = SizesOf(model->strips().phase_offsets);
  if (use.has_strip_rows) on_device->phase_blocks = SizesOf(packed.rows.phase_blocks);
  models_[key] = on_device;
  on_device->model = std::move(model);
  return std::shared_ptr<const DeviceModel>(on_device);
}

}  // namespace drape
