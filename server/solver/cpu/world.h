// Cloths that touch each other and are stepped together.
#pragma once

#include <memory>
#include <span>
#include <vector>

#include "server/solver/cpu/cpu_cloth.h"
#include "server/solver/self_contact/contact_surface.h"

namespace drape::cpu {

// What follows from the schemes and models of the cloths of a world. Immutable.
struct World {
  std::vector<std::shared_ptr<const Scheme>> of_cloths;  // that it was made of
  std::vector<std::shared_ptr<const Scheme>> schemes;    // of each cloth in this world
  std::shared_ptr<const ContactSurface> surface;
};

// Of the cloths in the order of their world; made anew when one of them has changed.
std::shared_ptr<const World> WorldOf(std::span<Cloth* const> cloths, ContactSurfaceCache& surfaces,
                                     Interruption* interruption);

// Of the cloth with most particles.
uint32_t LargestOf(std::span<Cloth* const> cloths);

// What the contexts of all cloths of a world have in common.
void EnterWorld(const World& world, std::span<const StepItem> items, SteppedCloths cloths);

// The reports of cloths that are faulted and therefore not stepped: one, or all of a world.
void MeasureFaulted(std::span<Cloth* const> cloths, std::span<const SteppedCloth> stepped,
                    std::span<StepReport> reports);

}  // namespace drape::cpu
