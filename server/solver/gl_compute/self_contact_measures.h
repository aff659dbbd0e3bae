// What the host finds of the contacts of a cloth with itself, exactly, in positions that it has
// read: x, y, z of each particle [m]. Pure.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "server/solver/cloth_parameters.h"
#include "server/solver/self_contact/contact_surface.h"
#include "server/solver/step_report.h"

namespace drape {

// [particle_count] 1: of an edge or a triangle that crosses another one. Empty: none does.
std::vector<uint32_t> FlagCrossings(const ContactSurface& surface,
                                    std::span<const float> positions);

// Adds near pairs, their smallest distance and crossings.
void AddSelfContacts(const ContactSurface& surface, const ClothParameters& parameters,
                     std::span<const float> positions, Measurements& measured);

}  // namespace drape
