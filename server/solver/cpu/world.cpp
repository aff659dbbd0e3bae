#include "server/solver/cpu/world.h"

#include <algorithm>

#include "server/core/check.h"
#include "server/solver/cpu/step/measure.h"
#include "server/solver/world_settings.h"

namespace drape::cpu {
namespace {

bool IsOf(const World& world, std::span<Cloth* const> cloths) {
  return std::ranges::equal(world.of_cloths, cloths, [](const auto& scheme, const Cloth* cloth) {
    return scheme == cloth->scheme;
  });
}

WorldSettings SettingsOf(std::span<Cloth* const> cloths) {
  std::vector<WorldCloth> of_world;
  for (const Cloth* const cloth : cloths) {
    DRAPE_CHECK(
        cloth->parameters.settings.time_step_s == cloths[0]->parameters.settings.time_step_s,
        "the cloths of a world have the same time step");
    of_world.push_back({cloth->model->source.get(), &cloth->parameters,
                        cloth->own_lengths ? LengthSource::kOwn : LengthSource::kModel});
  }
  return SettingsOfWorld(of_world, ScalarType::kFloat32);
}

std::shared_ptr<const Scheme> SchemeIn(const Cloth& cloth, const WorldSettings& settings) {
  const ClothParameters in_world = InWorld(cloth.parameters, settings);
  if (in_world.settings == cloth.parameters.settings) return cloth.scheme;
  return std::make_shared<const Scheme>(*cloth.model, in_world, cloth.own_lengths.has_value());
}

}  // namespace

std::shared_ptr<const World> WorldOf(std::span<Cloth* const> cloths, ContactSurfaceCache& surfaces,
                                     Interruption* interruption) {
  std::shared_ptr<const World>& kept = cloths[0]->world;
  if (kept != nullptr && IsOf(*kept, cloths)) return kept;
  auto world = std::make_shared<World>();
  const WorldSettings settings = SettingsOf(cloths);
  std::vector<std::shared_ptr<const ContactSurface>> of_cloths;
  std::vector<SurfaceMember> members;
  for (const Cloth* const cloth : cloths) {
    world->of_cloths.push_back(cloth->scheme);
    world->schemes.push_back(SchemeIn(*cloth, settings));
    of_cloths.push_back(surfaces.Get(cloth->model->source));
    members.push_back({of_cloths.back().get(), cloth->contact_surface != nullptr});
  }
  world->surface = std::make_shared<const ContactSurface>(members, interruption);
  return kept = world;
}

uint32_t LargestOf(std::span<Cloth* const> cloths) {
  uint32_t largest = 0;
  for (const Cloth* const cloth : cloths) {
    largest = std::max(largest, cloth->model->particle_count);
  }
  return largest;
}

void EnterWorld(const World& world, std::span<const StepItem> items, SteppedCloths cloths) {
  uint32_t most_sweeps = UINT32_MAX;
  for (const SteppedCloth& cloth : cloths) {
    most_sweeps = std::min(most_sweeps, cloth.context.max_iterations);
  }
  for (size_t k = 0; k < cloths.size(); ++k) {
    StepContext& context = cloths[k].context;
    context.max_iterations = most_sweeps;
    context.contact_surface = world.surface.get();
    context.world_origin = ToVec4(items[k].world.origin_m - items[0].world.origin_m);
  }
}

void MeasureFaulted(std::span<Cloth* const> cloths, std::span<const SteppedCloth> stepped,
                    std::span<StepReport> reports) {
  std::vector<MeasuredCloth> measured;
  for (const auto& [context, measure, state] : stepped) measured.push_back({context, state});
  const bool is_any_measured = std::ranges::any_of(stepped, &SteppedCloth::measure);
  const auto contacts = is_any_measured ? MeasureSelfContacts(measured)
                                        : std::vector<self_contact::SelfContactMeasures>();
  for (size_t k = 0; k < cloths.size(); ++k) {
    const auto& [context, measure, state] = stepped[k];
    reports[k].fault = cloths[k]->fault;
    if (!measure) continue;
    reports[k].measured = Measure(context, state, reports[k].fault);
    if (!contacts.empty()) Tell(contacts[k], reports[k].measured);
  }
}

}  // namespace drape::cpu
