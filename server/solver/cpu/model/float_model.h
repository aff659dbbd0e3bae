// A scene model in single precision, packed for the sweeps.
#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <memory>
#include <mutex>
#include <span>
#include <unordered_map>
#include <vector>

#include "server/scene/scene_model.h"
#include "server/solver/cpu/model/grid_elements.h"
#include "server/solver/cpu/simd/numbers8.h"
#include "server/solver/cpu/simd/vec4.h"

namespace drape::cpu {

// Four constraints of one colour. A colour is filled up with constraints of rest length 0 between
// the spare particle and itself: they change nothing.
struct DistanceGroup {
  std::array<uint32_t, kVec4Size> i;
  std::array<uint32_t, kVec4Size> j;
  Vec4 rest_length;  // [m]
  Vec4 inverse_mass_i;
  Vec4 inverse_mass_j;
};

// One link of each of several strips of a phase side by side. Ends are the particles or places of
// each lane, Numbers a number of each lane. Shorter strips are filled up with links from their last
// particle to itself that no impulse moves.
template <class Ends, class Numbers>
struct StripLinks {
  Ends to;  // the particle at the end of the link
  // Index of the compliance and of the accumulated impulse (FloatModel::compliances).
  Ends places;
  Numbers rest_length;             // [m]
  Numbers inverse_rest_length_sq;  // [1/m^2]; 0 for padding
  Numbers inverse_mass_from;       // [1/kg]; 0 for padding
  Numbers inverse_mass_to;
  Numbers diagonal;   // inverse_mass_from + inverse_mass_to; 1 for padding
  Numbers min_pivot;  // share of the diagonal
  bool has_pins;      // `to` is a pin, or of no strip, in some lane
};

// Strips of a phase side by side. Others of their phase may have the same pins.
template <class Ends, class Numbers>
struct Strips {
  Ends first;           // their first particles
  Ends constraints;     // the first of each
  Numbers span;         // 1: a span (FindSpans); else 0
  uint32_t link_begin;  // in the array of their links
  uint32_t link_end;
};

using StripLink = StripLinks<std::array<uint32_t, kVec8Size>, Numbers8>;
using StripGroup = Strips<std::array<uint32_t, kVec8Size>, Numbers8>;

// Two strips, the same of several cloths.
struct NumberPair {
  float low, high;

  void Set(uint32_t strip, float value) { (strip == 0 ? low : high) = value; }
  friend bool operator==(const NumberPair&, const NumberPair&) = default;
};
using PairLink = StripLinks<std::array<uint32_t, 2>, NumberPair>;
using StripPair = Strips<std::array<uint32_t, 2>, NumberPair>;

// Bounds of the accumulated impulses of four constraints [N s]: at most 0 for a rope, at least 0
// for a strut, none for others.
struct ImpulseBounds {
  Vec4 min;
  Vec4 max;
};

struct FloatJoint {
  uint32_t i;
  uint32_t j;
  float inverse_mass_i;
  float inverse_mass_j;
  float compliance;  // [m/N]
};

// Four tethers of different particles. Filled up with tethers from a particle to itself.
struct TetherGroup {
  std::array<uint32_t, kVec4Size> particle;
  std::array<uint32_t, kVec4Size> pin;
  Vec4 length;  // [m]
};

struct SingleTether {
  uint32_t particle;
  uint32_t pin;
  uint32_t pin_index;  // of the pin in FloatModel::pins
  float length;        // [m]
};

// Four triangles. Filled up with triangles of the spare particle alone.
struct TriangleGroup {
  std::array<std::array<uint32_t, kVec4Size>, 3> corners;
  std::array<Vec4, 3> weights;  // of the corners in their mean, from TriangleShares::corner_shares
  Vec4 mass;                    // [kg] TriangleShares::masses_kg
};

// Four elastic elements. Filled up with elements of the spare particle alone.
struct ElasticGroup {
  std::array<std::array<uint32_t, kVec4Size>, 4> particles;
  std::array<Vec4, 3> weights;  // of the second to fourth particle
  Vec4 rest_length;             // [m]
  Vec4 mass;                    // [kg] ElasticShares::masses_kg
  Vec4 frequency_sq;            // [1/s^2]
  Vec4 damping_share;
};

struct FloatElasticEnd {
  uint32_t impulse;
  float weight;
};

struct FloatSpringEnd {
  uint32_t other_particle;
  float rest_length;  // [m]
  float stiffness;    // [N/m]
  float damping;      // [N s/m]
};

// One place of several lines of elastic elements side by side: the particle of each lane and its
// ElasticEntry (scene/elastic_lines.h). Shorter lines are filled up with their last particle,
// without mass and elements; missing ones with the spare particle, those of cells with the last
// line again.
template <class Ends, class Numbers>
struct ElasticPlace {
  Ends particles;
  Numbers inverse_mass;
  Numbers elasticity;
  Numbers inverse_pivot;
  Numbers to_next;
  Numbers to_second_next;
  bool has_pins;  // some lane has a particle that no impulse moves
};

// The lines of all families side by side.
template <class Ends, class Numbers>
struct ElasticGroups {
  std::vector<ElasticPlace<Ends, Numbers>> places;
  std::vector<uint32_t> place_offsets{0};   // [group_count + 1]
  std::vector<uint32_t> family_offsets{0};  // [family_count + 1] groups

  std::span<const ElasticPlace<Ends, Numbers>> PlacesOf(size_t group) const {
    return std::span(places).subspan(place_offsets[group],
                                     place_offsets[group + 1] - place_offsets[group]);
  }
};

using PairPlace = ElasticPlace<std::array<uint32_t, 2>, NumberPair>;

// What solves the lines of elastic elements of a model, of one cloth and of several.
struct ElasticEntries {
  ElasticGroups<std::array<uint32_t, kVec8Size>, Numbers8> eights;
  ElasticGroups<std::array<uint32_t, 2>, NumberPair> pairs;
};

struct FloatModel;

// The entries of a model by the s that they are made for, for as long as a cloth uses them. Any
// thread.
class ElasticEntriesCache {
 public:
  std::shared_ptr<const ElasticEntries> Get(const FloatModel& model, double s_s2);

 private:
  std::mutex mutex_;
  std::map<double, std::weak_ptr<const ElasticEntries>> entries_;
};

// Constant after construction; shared by all cloths of one SceneModel, which it keeps alive.
struct FloatModel {
  // `shared_layout`: of a model that this one differs from by its pins alone (FitsLayout); null: it
  // has its own.
  explicit FloatModel(std::shared_ptr<const SceneModel> scene_model,
                      std::shared_ptr<const FloatModel> shared_layout = nullptr);

  std::shared_ptr<const SceneModel> source;
  uint32_t particle_count;
  std::vector<uint32_t> free_particles;  // ascending
  std::vector<uint32_t> pins;            // ascending
  std::vector<float> inverse_masses;     // [particle_count] [1/kg]
  std::vector<float> free_masses;        // [particle_count] [kg]; 0: pins
  std::vector<DistanceGroup> groups;     // colour after colour
  std::vector<uint32_t> colour_offsets;  // [colour_count + 1] groups
  // [constraint_count]: where constraint c of the source is, as group * kVec4Size + lane.
  std::vector<uint32_t> constraint_places;
  // [group_count + 1] [m/N], the last of padding; empty if all are 0.
  std::vector<Vec4> compliances;
  std::vector<StripGroup> strips;             // phase after phase
  std::vector<uint32_t> strip_phase_offsets;  // [phase_count + 1] groups of strips
  std::vector<StripLink> strip_links;
  std::vector<Numbers8> strip_compliances;  // of strip_links [m/N]; empty if all are 0
  std::vector<StripPair> strip_pairs;       // the same in pairs
  std::vector<PairLink> pair_links;
  std::vector<NumberPair> pair_compliances;
  // The free particles in the order in which the pairs need them, first those of pair 0; those that
  // no strip has come last. [pair_count + 2] offsets.
  std::vector<uint32_t> pair_particles;
  std::vector<uint32_t> pair_particle_offsets;
  std::vector<bool> spanned_constraints;  // those of spans (FindSpans); empty: there are none
  uint32_t longest_strip = 0;             // links
  uint32_t longest_elastic_line = 0;      // particles
  // The places of the constraints of each particle: [particle_count + 1] offsets.
  std::vector<uint32_t> link_offsets;
  std::vector<uint32_t> link_places;
  std::vector<ImpulseBounds> bounds;  // [group_count]; empty if all constraints are equalities
  std::vector<FloatJoint> joints;     // in the order of the source
  // One block per four free particles: their first tethers, then the next ones, and so on. Blocks
  // are independent of each other.
  std::vector<TetherGroup> tethers;
  std::vector<uint32_t> tether_block_offsets;  // [ceil(free particles / 4) + 1] groups
  std::vector<SingleTether> single_tethers;    // as in the source: particle by particle
  std::vector<TriangleGroup> triangles;        // in the order of the source
  std::vector<float> corner_shares;            // [particle_count]; only with triangles
  std::vector<ElasticGroup> elastic_groups;    // in the order of the source
  std::vector<uint32_t> elastic_offsets;       // [particle_count + 1]
  std::vector<FloatElasticEnd> elastic_ends;   // as ElasticEnd
  std::vector<uint32_t> spring_offsets;        // [particle_count + 1]; empty without springs
  std::vector<FloatSpringEnd> spring_ends;
  float length_scale;  // [m]
  mutable ElasticEntriesCache elastic_entries;
  GridElements grid_elements;
  mutable GridStrengthsCache grid_strengths;

  // The model whose particles, links and their order the cloths of a group share, whatever they
  // have pinned.
  const FloatModel& layout() const { return layout_ != nullptr ? *layout_ : *this; }
  // The particle that padding constraints refer to: arrays have one element more than particles.
  uint32_t spare_particle() const { return particle_count; }
  // Neither a pin nor the spare particle.
  bool IsFree(uint32_t i) const { return i < particle_count && inverse_masses[i] != 0; }
  bool IsSpanned(uint32_t constraint) const {
    return !spanned_constraints.empty() && spanned_constraints[constraint];
  }
  bool has_compliance() const { return !compliances.empty(); }
  // A sweep comes back through phases of strips (AddWaysBack).
  bool has_ways_back() const {
    return source->strips().phase_count() > source->strips().phase_count_there;
  }
  bool has_inequalities() const { return !bounds.empty(); }
  // Set for the constraints of a group that are rigid equalities: velocities must keep them as
  // well.
  Mask4 RigidLanes(size_t group) const {
    Mask4 mask = Splat(0) == Splat(0);
    if (has_compliance()) mask &= compliances[group] == 0;
    if (has_inequalities()) mask &= (bounds[group].min < 0) & (bounds[group].max > 0);
    return mask;
  }
  bool has_springs() const { return !spring_offsets.empty(); }

 private:
  std::shared_ptr<const FloatModel> layout_;
};

// One FloatModel per SceneModel object, for as long as somebody uses it. Thread-safe; who gets what
// is there does not wait for others who make another one.
class FloatModelCache {
 public:
  std::shared_ptr<const FloatModel> Get(const std::shared_ptr<const SceneModel>& model);
  // Counts the models in use.
  size_t size() const;

 private:
  struct Layout {
    std::shared_ptr<const FloatModel> model;  // null: none in use fits
    uint64_t last = 0;                        // the number of the newest one that was looked at
  };
  Layout FindLayout(const SceneModel& model, uint64_t hash) const;
  // What is there, or null.
  std::shared_ptr<const FloatModel> Find(const SceneModel* model) const;
  // Adds what was made for a model, as a layout if it is one; returns what is there now. Null: a
  // layout has come since FindLayout.
  std::shared_ptr<const FloatModel> Add(const SceneModel* model, uint64_t hash,
                                        const Layout& layout,
                                        const std::shared_ptr<const FloatModel>& made);
  void DropDead();

  mutable std::mutex mutex_;
  uint64_t last_layout_ = 0;  // number
  std::unordered_map<const SceneModel*, std::weak_ptr<const FloatModel>> models_;
  // Those that are their own layouts, by LayoutHash.
  std::unordered_multimap<uint64_t, std::weak_ptr<const FloatModel>> layouts_;
  // Dead entries are dropped when there are more of either than this: to look at all of them with
  // each new model would be the square of their number.
  size_t next_sweep_size_ = 64;
};

}  // namespace drape::cpu
