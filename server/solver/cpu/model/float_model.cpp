#include "server/solver/cpu/model/float_model.h"

#include <algorithm>
#include <limits>
#include <numeric>
#include <span>
#include <tuple>
#include <utility>

#include "server/solver/cpu/model/layout.h"
#include "server/solver/solver_constants.h"

namespace drape::cpu {
namespace {

// Weight 1 keeps the division of a padding constraint finite.
DistanceGroup PaddingGroup(uint32_t spare_particle) {
  DistanceGroup group;
  group.i.fill(spare_particle);
  group.j.fill(spare_particle);
  group.rest_length = Splat(0);
  group.inverse_mass_i = Splat(1);
  group.inverse_mass_j = Splat(1);
  return group;
}

constexpr float kNoBound = std::numeric_limits<float>::infinity();

void PackConstraints(FloatModel& model) {
  const SceneModel& source = *model.source;
  const auto constraints = source.constraints();
  const auto colour_offsets = source.colour_offsets();
  model.constraint_places.resize(constraints.size());
  for (uint32_t colour = 0; colour < source.colour_count(); ++colour) {
    model.colour_offsets.push_back(static_cast<uint32_t>(model.groups.size()));
    for (uint32_t c = colour_offsets[colour]; c < colour_offsets[colour + 1]; ++c) {
      const uint32_t lane = (c - colour_offsets[colour]) % kVec4Size;
      if (lane == 0) {
        model.groups.push_back(PaddingGroup(model.spare_particle()));
        if (source.has_compliance()) model.compliances.push_back(Splat(0));
        if (source.has_inequalities()) model.bounds.push_back({Splat(-kNoBound), Splat(kNoBound)});
      }
      const DistanceConstraint& constraint = constraints[c];
      DistanceGroup& group = model.groups.back();
      group.i[lane] = constraint.i;
      group.j[lane] = constraint.j;
      group.rest_length[lane] = static_cast<float>(constraint.rest_length_m);
      group.inverse_mass_i[lane] = model.inverse_masses[constraint.i];
      group.inverse_mass_j[lane] = model.inverse_masses[constraint.j];
      if (source.has_compliance()) {
        model.compliances.back()[lane] = static_cast<float>(constraint.compliance_m_per_n);
      }
      if (constraint.kind == ConstraintKind::kAtMost) model.bounds.back().max[lane] = 0;
      if (constraint.kind == ConstraintKind::kAtLeast) model.bounds.back().min[lane] = 0;
      model.constraint_places[c] =
          static_cast<uint32_t>((model.groups.size() - 1) * kVec4Size + lane);
    }
  }
  model.colour_offsets.push_back(static_cast<uint32_t>(model.groups.size()));
}

// The places of the constraints of each particle.
void ListLinks(FloatModel& model) {
  const auto constraints = model.source->constraints();
  model.link_offsets.assign(model.particle_count + size_t{1}, 0);
  for (const DistanceConstraint& constraint : constraints) {
    ++model.link_offsets[constraint.i + size_t{1}];
    ++model.link_offsets[constraint.j + size_t{1}];
  }
  std::partial_sum(model.link_offsets.begin(), model.link_offsets.end(),
                   model.link_offsets.begin());
  model.link_places.resize(2 * constraints.size());
  std::vector<uint32_t> next = model.link_offsets;
  for (size_t c = 0; c < constraints.size(); ++c) {
    model.link_places[next[constraints[c].i]++] = model.constraint_places[c];
    model.link_places[next[constraints[c].j]++] = model.constraint_places[c];
  }
}

// Whether each constraint is on a span; empty if none is.
std::vector<bool> FindSpannedConstraints(const SceneModel& source) {
  if (!source.has_spans()) return {};
  const StripSet& strips = source.strips();
  std::vector<bool> is_spanned(strips.constraints.size(), false);
  for (uint32_t s = 0; s < strips.strip_count(); ++s) {
    for (uint32_t k = strips.strip_offsets[s]; k < strips.strip_offsets[s + 1]; ++k) {
      is_spanned[strips.constraints[k]] = source.IsSpan(s);
    }
  }
  return is_spanned;
}

// Lane `lane` of the links of a group, from strip `strip`; `links` are those of the group.
template <class Link>
void PackStripLane(const FloatModel& model, uint32_t strip, uint32_t lane, std::span<Link> links) {
  const StripSet& strips = model.source->strips();
  const std::vector<float>& w = model.inverse_masses;
  const uint32_t begin = strips.strip_offsets[strip], end = strips.strip_offsets[strip + 1];
  for (uint32_t k = begin; k < end; ++k) {
    Link& link = links[k - begin];
    const uint32_t from = strips.particles[k + strip], to = strips.particles[k + strip + 1];
    const DistanceConstraint& constraint = model.source->constraints()[strips.constraints[k]];
    link.to[lane] = to;
    link.places[lane] = model.constraint_places[strips.constraints[k]];
    const float rest_length = static_cast<float>(constraint.rest_length_m);
    link.rest_length.Set(lane, rest_length);
    link.inverse_rest_length_sq.Set(lane, 1 / (rest_length * rest_length));
    link.min_pivot.Set(lane, static_cast<float>(w[to] == 0 ? kMinStripPivotAtPin : kMinStripPivot));
    link.inverse_mass_from.Set(lane, w[from]);
    link.inverse_mass_to.Set(lane, w[to]);
    link.diagonal.Set(lane, w[from] + w[to]);
  }
  for (Link& link : links.subspan(end - begin)) link.to[lane] = strips.particles[end + strip];
}

template <class Link>
Link PaddingLink(const FloatModel& model) {
  Link padding{};
  padding.to.fill(model.spare_particle());
  padding.has_pins = false;
  padding.places.fill(static_cast<uint32_t>(model.groups.size() * kVec4Size));
  for (uint32_t lane = 0; lane < padding.to.size(); ++lane) padding.diagonal.Set(lane, 1);
  return padding;
}

// Strips of a phase are sorted by length, so little is padding. Returns where the groups of each
// phase begin, and where the last ends.
template <class Ends, class Numbers, class Link>
std::vector<uint32_t> PackStrips(FloatModel& model, std::vector<Strips<Ends, Numbers>>& groups,
                                 std::vector<Link>& links) {
  std::vector<uint32_t> phase_offsets;
  constexpr uint32_t kCount = std::tuple_size_v<Ends>;
  const StripSet& strips = model.source->strips();
  for (uint32_t phase = 0; phase < strips.phase_count(); ++phase) {
    phase_offsets.push_back(static_cast<uint32_t>(groups.size()));
    const uint32_t phase_end = strips.phase_offsets[phase + 1];
    for (uint32_t s = strips.phase_offsets[phase]; s < phase_end; s += kCount) {
      const uint32_t lane_count = std::min(kCount, phase_end - s);
      uint32_t length = 0;
      for (uint32_t k = s; k < s + lane_count; ++k) {
        length = std::max(length, strips.strip_offsets[k + 1] - strips.strip_offsets[k]);
      }
      Strips<Ends, Numbers> group{};
      group.first.fill(model.spare_particle());
      group.link_begin = static_cast<uint32_t>(links.size());
      group.link_end = group.link_begin + length;
      links.resize(group.link_end, PaddingLink<Link>(model));
      for (uint32_t lane = 0; lane < lane_count; ++lane) {
        group.first[lane] = strips.particles[strips.strip_offsets[s + lane] + s + lane];
        group.constraints[lane] = strips.constraints[strips.strip_offsets[s + lane]];
        group.span.Set(lane, model.source->IsSpan(s + lane) ? 1 : 0);
        PackStripLane(model, s + lane, lane, std::span(links).subspan(group.link_begin));
      }
      for (Link& link : std::span(links).subspan(group.link_begin)) {
        link.has_pins = std::any_of(link.to.begin(), link.to.end(), [&](uint32_t i) {
          return i == model.spare_particle() || model.inverse_masses[i] == 0;
        });
      }
      model.longest_strip = std::max(model.longest_strip, length);
      groups.push_back(group);
    }
  }
  phase_offsets.push_back(static_cast<uint32_t>(groups.size()));
  return phase_offsets;
}

// Lane `lane` of a group whose places those are, from a line.
template <class Place>
void PackElasticLane(const FloatModel& model, const ElasticLine& line,
                     std::span<const ElasticEntry> entries, uint32_t lane,
                     std::span<Place> places) {
  const uint32_t last = line.first + (line.count - 1) * line.stride;
  for (uint32_t k = 0; k < places.size(); ++k) {
    Place& place = places[k];
    place.particles[lane] = last;
    if (k >= line.count) continue;
    const ElasticEntry& entry = entries[line.entry_begin + k];
    const uint32_t i = line.first + k * line.stride;
    place.particles[lane] = i;
    place.inverse_mass.Set(lane, model.inverse_masses[i]);
    place.elasticity.Set(lane, static_cast<float>(entry.elasticity));
    place.inverse_pivot.Set(lane, static_cast<float>(entry.inverse_pivot));
    place.to_next.Set(lane, static_cast<float>(entry.to_next));
    place.to_second_next.Set(lane, static_cast<float>(entry.to_second_next));
  }
}

template <class Ends, class Numbers>
void PackElasticLines(const FloatModel& model, std::span<const ElasticEntry> entries,
                      ElasticGroups<Ends, Numbers>& groups) {
  constexpr uint32_t kCount = std::tuple_size_v<Ends>;
  const ElasticLines& lines = model.source->elastic_lines();
  ElasticPlace<Ends, Numbers> padding{};
  padding.particles.fill(model.spare_particle());
  for (const ElasticFamily& family : lines.families) {
    const bool is_diagonals = family.kind == ElasticKind::kDiagonals;
    for (uint32_t lane = 0; lane < kCount; ++lane) {
      padding.elasticity.Set(lane, is_diagonals ? std::numeric_limits<float>::infinity() : 0);
    }
    for (uint32_t begin = family.line_begin; begin < family.line_end; begin += kCount) {
      const uint32_t end = std::min(begin + kCount, family.line_end);
      uint32_t count = 0;
      for (uint32_t k = begin; k < end; ++k) count = std::max(count, lines.lines[k].count);
      groups.places.resize(groups.places.size() + count, padding);
      const auto places = std::span(groups.places).last(count);
      const uint32_t filled = family.kind == ElasticKind::kCells ? begin + kCount : end;
      for (uint32_t k = begin; k < filled; ++k) {
        PackElasticLane(model, lines.lines[std::min(k, end - 1)], entries, k - begin, places);
      }
      for (ElasticPlace<Ends, Numbers>& place : places) {
        place.has_pins =
            !std::ranges::all_of(place.particles, [&](uint32_t i) { return model.IsFree(i); });
      }
      groups.place_offsets.push_back(static_cast<uint32_t>(groups.places.size()));
    }
    groups.family_offsets.push_back(static_cast<uint32_t>(groups.place_offsets.size()) - 1);
  }
}

// The particles that each pair is the first to need.
void OrderParticles(FloatModel& model) {
  std::vector<bool> is_new(model.particle_count + size_t{1}, false);
  for (const uint32_t i : model.free_particles) is_new[i] = true;
  std::vector<uint32_t>& order = model.pair_particles;
  const auto add = [&](uint32_t i) {
    if (is_new[i]) order.push_back(i);
    is_new[i] = false;
  };
  for (const StripPair& pair : model.strip_pairs) {
    const size_t begin = order.size();
    model.pair_particle_offsets.push_back(static_cast<uint32_t>(begin));
    for (const uint32_t i : pair.first) add(i);
    for (uint32_t k = pair.link_begin; k < pair.link_end; ++k) {
      for (const uint32_t i : model.pair_links[k].to) add(i);
    }
    std::sort(order.begin() + static_cast<std::ptrdiff_t>(begin), order.end());
  }
  model.pair_particle_offsets.push_back(static_cast<uint32_t>(order.size()));
  for (const uint32_t i : model.free_particles) add(i);
  model.pair_particle_offsets.push_back(static_cast<uint32_t>(order.size()));
}

// [links] of each lane, from where the constraints have them.
template <class Numbers, class Link>
std::vector<Numbers> PackCompliances(const FloatModel& model, const std::vector<Link>& links) {
  if (!model.has_compliance()) return {};
  std::vector<Numbers> compliances(links.size());
  for (size_t k = 0; k < links.size(); ++k) {
    for (uint32_t lane = 0; lane < links[k].places.size(); ++lane) {
      const uint32_t place = links[k].places[lane];
      compliances[k].Set(lane, model.compliances[place / kVec4Size][place % kVec4Size]);
    }
  }
  return compliances;
}

void PackJoints(FloatModel& model) {
  for (const auto& [i, j, compliance] : model.source->joints()) {
    model.joints.push_back(
        {i, j, model.inverse_masses[i], model.inverse_masses[j], static_cast<float>(compliance)});
  }
}

// Rank by rank, so that the lanes of a group never share a particle and each particle meets its
// pins in their order. `particles`: at most four.
void PackTetherBlock(FloatModel& model, std::span<const uint32_t> particles) {
  const std::span<const uint32_t> offsets = model.source->tether_offsets();
  uint32_t ranks = 0;
  for (const uint32_t i : particles) ranks = std::max(ranks, offsets[i + 1] - offsets[i]);
  for (uint32_t rank = 0; rank < ranks; ++rank) {
    TetherGroup& group = model.tethers.emplace_back();
    group.particle.fill(model.spare_particle());
    std::copy(particles.begin(), particles.end(), group.particle.begin());
    group.pin = group.particle;
    group.length = Splat(1);
    for (uint32_t lane = 0; lane < particles.size(); ++lane) {
      const uint32_t t = offsets[particles[lane]] + rank;
      if (t >= offsets[particles[lane] + 1]) continue;
      group.pin[lane] = model.source->tethers()[t].pin;
      group.length[lane] = static_cast<float>(model.source->tethers()[t].length_m);
    }
  }
  model.tether_block_offsets.push_back(static_cast<uint32_t>(model.tethers.size()));
}

void PackTethers(FloatModel& model) {
  const std::span<const uint32_t> offsets = model.source->tether_offsets();
  for (uint32_t particle = 0; particle < model.particle_count; ++particle) {
    for (uint32_t t = offsets[particle]; t < offsets[particle + 1]; ++t) {
      const Tether& tether = model.source->tethers()[t];
      const auto place = std::ranges::lower_bound(model.pins, tether.pin);
      model.single_tethers.push_back({particle, tether.pin,
                                      static_cast<uint32_t>(place - model.pins.begin()),
                                      static_cast<float>(tether.length_m)});
    }
  }
  model.tether_block_offsets.push_back(0);
  const std::span<const uint32_t> particles = model.free_particles;
  for (size_t begin = 0; begin < particles.size(); begin += kVec4Size) {
    const size_t count = std::min<size_t>(kVec4Size, particles.size() - begin);
    PackTetherBlock(model, particles.subspan(begin, count));
  }
}

void PackTriangles(FloatModel& model) {
  const auto triangles = model.source->triangles();
  const auto shares = model.source->corner_shares();
  if (!triangles.empty()) model.corner_shares.assign(shares.begin(), shares.end());
  for (size_t t = 0; t < triangles.size(); ++t) {
    const size_t lane = t % kVec4Size;
    if (lane == 0) {
      model.triangles.emplace_back();
      for (auto& corner : model.triangles.back().corners) corner.fill(model.spare_particle());
      model.triangles.back().weights.fill(Splat(0));
      model.triangles.back().mass = Splat(1);
    }
    TriangleGroup& group = model.triangles.back();
    double sum = 0;
    for (const uint32_t corner : triangles[t]) sum += shares[corner];
    for (size_t corner = 0; corner < 3; ++corner) {
      group.corners[corner][lane] = triangles[t][corner];
      group.weights[corner][lane] = static_cast<float>(shares[triangles[t][corner]] / sum);
    }
    group.mass[lane] = static_cast<float>(model.source->triangle_masses_kg()[t]);
  }
}

ElasticGroup PaddingElements(uint32_t spare_particle) {
  ElasticGroup group{};
  for (auto& place : group.particles) place.fill(spare_particle);
  return group;
}

void PackElastic(FloatModel& model) {
  const auto elements = model.source->elastic_elements();
  const ElasticShares& shares = model.source->elastic_shares();
  for (size_t e = 0; e < elements.size(); ++e) {
    const size_t lane = e % kVec4Size;
    if (lane == 0) model.elastic_groups.push_back(PaddingElements(model.spare_particle()));
    ElasticGroup& group = model.elastic_groups.back();
    for (size_t k = 0; k < 4; ++k) {
      group.particles[k][lane] = elements[e].particles[k];
      if (k > 0) group.weights[k - 1][lane] = static_cast<float>(elements[e].weights[k]);
    }
    group.rest_length[lane] = static_cast<float>(elements[e].rest_length_m);
    group.damping_share[lane] = static_cast<float>(elements[e].damping_share);
    group.mass[lane] = static_cast<float>(shares.masses_kg[e]);
    group.frequency_sq[lane] = static_cast<float>(shares.frequencies_sq_per_s2[e]);
  }
  if (model.elastic_groups.size() % 2 != 0) {  // eight elements are computed at a time
    model.elastic_groups.push_back(PaddingElements(model.spare_particle()));
  }
  model.elastic_offsets = shares.offsets;
  for (const ElasticEnd& end : shares.ends) {
    model.elastic_ends.push_back({end.impulse, static_cast<float>(end.weight)});
  }
}

void PackSprings(FloatModel& model) {
  const SceneModel& source = *model.source;
  if (source.spring_count() == 0) return;
  model.spring_offsets.assign(source.spring_offsets().begin(), source.spring_offsets().end());
  for (const SpringEnd& end : source.spring_ends()) {
    model.spring_ends.push_back({end.other_particle, static_cast<float>(end.rest_length_m),
                                 static_cast<float>(end.stiffness_n_per_m),
                                 static_cast<float>(end.damping_n_s_per_m)});
  }
}

}  // namespace

FloatModel::FloatModel(std::shared_ptr<const SceneModel> scene_model,
                       std::shared_ptr<const FloatModel> shared_layout)
    : source(std::move(scene_model)),
      particle_count(source->particle_count()),
      pins(source->pins().begin(), source->pins().end()),
      length_scale(static_cast<float>(source->length_scale_m())),
      grid_elements(*source),
      layout_(std::move(shared_layout)) {
  for (uint32_t particle = 0; particle < particle_count; ++particle) {
    const double inverse_mass = source->inverse_masses_per_kg()[particle];
    inverse_masses.push_back(static_cast<float>(inverse_mass));
    free_masses.push_back(inverse_mass > 0 ? static_cast<float>(source->masses_kg()[particle])
                                           : 0.0f);
    if (inverse_mass > 0) free_particles.push_back(particle);
  }
  PackConstraints(*this);
  ListLinks(*this);
  if (has_compliance()) compliances.push_back(Splat(0));
  PackJoints(*this);
  spanned_constraints = FindSpannedConstraints(*source);
  strip_phase_offsets = PackStrips(*this, strips, strip_links);
  PackStrips(*this, strip_pairs, pair_links);
  strip_compliances = PackCompliances<Numbers8>(*this, strip_links);
  pair_compliances = PackCompliances<NumberPair>(*this, pair_links);
  for (const ElasticLine& line : source->elastic_lines().lines) {
    longest_elastic_line = std::max(longest_elastic_line, line.count);
  }
  OrderParticles(*this);
  PackTethers(*this);
  PackTriangles(*this);
  PackElastic(*this);
  PackSprings(*this);
}

std::shared_ptr<const ElasticEntries> ElasticEntriesCache::Get(const FloatModel& model,
                                                               double s_s2) {
  const std::lock_guard lock(mutex_);
  if (auto found = entries_[s_s2].lock()) return found;
  const SceneModel& source = *model.source;
  const std::vector<ElasticEntry> entries = DecomposeElasticLines(
      source.elastic_lines(), source.inverse_masses_per_kg(), source.grid_columns(), s_s2);
  auto made = std::make_shared<ElasticEntries>();
  PackElasticLines(model, entries, made->eights);
  PackElasticLines(model, entries, made->pairs);
  std::erase_if(entries_, [](const auto& item) { return item.second.expired(); });
  entries_[s_s2] = made;
  return made;
}

std::shared_ptr<const FloatModel> FloatModelCache::Find(const SceneModel* model) const {
  const std::lock_guard lock(mutex_);
  const auto entry = models_.find(model);
  return entry == models_.end() ? nullptr : entry->second.lock();
}

FloatModelCache::Layout FloatModelCache::FindLayout(const SceneModel& model, uint64_t hash) const {
  Layout found;
  std::vector<std::shared_ptr<const FloatModel>> candidates;
  {
    const std::lock_guard lock(mutex_);
    found.last = last_layout_;
    const auto [begin, end] = layouts_.equal_range(hash);
    for (auto entry = begin; entry != end; ++entry) candidates.push_back(entry->second.lock());
  }
  for (auto& layout : candidates) {
    if (layout == nullptr || !FitsLayout(model, *layout->source)) continue;
    found.model = std::move(layout);
    break;
  }
  return found;
}

std::shared_ptr<const FloatModel> FloatModelCache::Add(
    const SceneModel* model, uint64_t hash, const Layout& layout,
    const std::shared_ptr<const FloatModel>& made) {
  const std::lock_guard lock(mutex_);
  std::weak_ptr<const FloatModel>& entry = models_[model];
  if (auto other = entry.lock()) return other;
  const bool is_layout = layout.model == nullptr;
  if (is_layout && layout.last != last_layout_) return nullptr;
  entry = made;
  if (is_layout) {
    layouts_.emplace(hash, made);
    ++last_layout_;
  }
  if (std::max(models_.size(), layouts_.size()) > next_sweep_size_) DropDead();
  return made;
}

void FloatModelCache::DropDead() {
  const auto is_expired = [](const auto& item) { return item.second.expired(); };
  std::erase_if(models_, is_expired);
  std::erase_if(layouts_, is_expired);
  next_sweep_size_ = std::max<size_t>(64, 2 * std::max(models_.size(), layouts_.size()));
}

std::shared_ptr<const FloatModel> FloatModelCache::Get(
    const std::shared_ptr<const SceneModel>& model) {
  if (auto found = Find(model.get())) return found;
  const uint64_t hash = LayoutHash(*model);
  std::shared_ptr<const FloatModel> made;  // as a layout, if it was to be one once
  while (true) {
    const Layout layout = FindLayout(*model, hash);
    if (made == nullptr || layout.model != nullptr) {
      made = std::make_shared<const FloatModel>(model, layout.model);
    }
    if (auto added = Add(model.get(), hash, layout, made)) return added;
  }
}

size_t FloatModelCache::size() const {
  const std::lock_guard lock(mutex_);
  return static_cast<size_t>(std::count_if(
      models_.begin(), models_.end(), [](const auto& item) { return !item.second.expired(); }));
}

}  // namespace drape::cpu
