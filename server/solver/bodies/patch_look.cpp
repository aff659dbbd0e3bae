// Where contacts of any shape are: what touches, where, and how far apart it is.
#include <algorithm>
#include <limits>
#include <vector>

#include "server/solver/bodies/patch_contacts.h"
#include "server/solver/bodies/rebound.h"
#include "server/solver/solver_constants.h"

namespace drape::bodies {

using Eigen::Vector3d;

namespace {

// What a contact may be off its surface [-], of the size of the body, and in roundings of its
// coordinates. Larger: bodies sink in by as much; smaller: more rounds. Velocities do not depend on
// it.
constexpr double kSlackOfReach = 1e-10;
constexpr double kSlackRoundOffs = 64;

}  // namespace

double PatchContacts::SlackOf(const std::vector<PlacedCollider>& placed, const Face& face) const {
  const double reach = reaches_m_[face.solid];
  const double size = placed[face.solid].end.position_m.cwiseAbs().sum() + reach;
  return kSlackOfReach * reach + kSlackRoundOffs * std::numeric_limits<double>::epsilon() * size;
}

// What lies on each other falls together: it is near, so that a column is one problem from the
// first round on, not one contact more in each.
double PatchContacts::NearOf(const std::vector<PlacedCollider>& placed, const Face& face) const {
  return 2 * SlackOf(placed, face);
}

SurfaceDistance PatchContacts::GapAtStart(const std::vector<PlacedCollider>& placed,
                                          const Contact& contact) const {
  const Face& face = faces_[contact.face];
  const PlacedCollider& solid = placed[face.solid];
  const PlacedCollider& other = placed[face.other];
  if (face.pair) return face.pair->GapAt(contact.spot, solid.start, other.start);
  SurfaceDistance gap = other.SurfaceAtStart(solid.start.PlaceOf(contact.spot.on_first));
  gap.distance_m -= contact.spot.round_of_first_m;
  return gap;
}

SurfaceDistance PatchContacts::GapAtEnd(const std::vector<PlacedCollider>& placed,
                                        const Contact& contact) const {
  const Face& face = faces_[contact.face];
  const PlacedCollider& solid = placed[face.solid];
  const PlacedCollider& other = placed[face.other];
  if (face.pair) return face.pair->GapAt(contact.spot, solid.end, other.end);
  SurfaceDistance gap = other.SurfaceAtEnd(solid.end.PlaceOf(contact.spot.on_first));
  gap.distance_m -= contact.spot.round_of_first_m;
  return gap;
}

void PatchContacts::PlacePoints(const std::vector<PlacedCollider>& placed, const Face& face) {
  const PlacedCollider& solid = placed[face.solid];
  const PlacedCollider& other = placed[face.other];
  const BodyPoints& points = points_[face.solid];
  const auto downwards = [&](const Vector3d& described) -> Vector3d {
    const Vector3d n = other.SurfaceAtEnd(solid.end.PlaceOf(described)).outward;
    return solid.end.rotation.conjugate() * -n;
  };
  const std::vector<Vector3d>& places = points.PlacesTowards(downwards, places_);
  for (size_t k = 0; k < places.size(); ++k) {
    PairSpot& spot = contacts_[face.first + k].spot;
    spot.on_first = places[k];
    spot.round_of_first_m = points.radius_m;
  }
}

// What was found for a spot in the substep before is where the solver starts at the same one.
void PatchContacts::PlaceSpots(const std::vector<PlacedCollider>& placed, Face& face) {
  if (face.keeps_spots) return;
  ConvexPair& pair = *face.pair;
  const auto first = contacts_.begin() + static_cast<std::ptrdiff_t>(face.first);
  const std::vector<Contact> before(first, first + static_cast<std::ptrdiff_t>(face.spot_count));
  const int parts_before = pair.parts();
  pair.FindSpots(placed[face.solid], placed[face.other], points_[face.solid], points_[face.other],
                 NearOf(placed, face), SlackOf(placed, face));
  face.spot_count = pair.spots().size();
  for (size_t k = 0; k < face.spot_count; ++k) {
    Contact& contact = contacts_[face.first + k];
    contact = {.face = contact.face, .spot = pair.spots()[k]};
    if (pair.parts() != parts_before) continue;
    const auto same = std::ranges::find(before, contact.spot.name,
                                        [](const Contact& its) { return its.spot.name; });
    if (same == before.end()) continue;
    contact.slides = same->slides;
    contact.guesses = same->guesses;
  }
}

void PatchContacts::LookAt(const std::vector<PlacedCollider>& placed, When when, Face& face) {
  const PlacedCollider& solid = placed[face.solid];
  const PlacedCollider& other = placed[face.other];
  // Distances between solids are no smaller than that of their centres tells. Samples may say less.
  const bool is_exact = other.collider->kind() != ShapeKind::kDistanceMap;
  face.is_never_near = is_exact && other.SurfaceAtEnd(solid.end.position_m).distance_m >
                                       1.01 * reaches_m_[face.solid];
  if (face.is_never_near) return;
  if (face.pair) {
    PlaceSpots(placed, face);
  } else {
    PlacePoints(placed, face);
  }
  const bool both_move = solid.body && other.body && when == When::kSubstep;
  const double near = NearOf(placed, face);
  for (size_t k = 0; k < face.spot_count; ++k) {
    Contact& contact = contacts_[face.first + k];
    const SurfaceDistance gap = GapAtEnd(placed, contact);
    contact.gap = gap.distance_m;
    contact.n = gap.outward;
    contact.touches |= contact.gap < near;
    if (!contact.touches) continue;
    face.keeps_spots = true;
    contact.floor = std::min(
        0.0, GapAtStart(placed, contact).distance_m + kMaxDepenetrationSpeed_m_per_s * seconds_);
    // From where both start, so that their angular momentum together stays as it is.
    const RigidMotion& solid_at = both_move ? solid.start : solid.end;
    const RigidMotion& other_at = both_move ? other.start : other.end;
    const Vector3d touching =
        solid_at.PlaceOf(contact.spot.on_first) - contact.spot.round_of_first_m * contact.n;
    contact.arm_of_solid = touching - solid_at.position_m;
    contact.arm_of_other = touching - other_at.position_m;
  }
}

bool PatchContacts::Look(const std::vector<PlacedCollider>& placed, When when) {
  for (Face& face : faces_) LookAt(placed, when, face);
  bool is_off = joints_.Look(placed, when);
  for (Contact& contact : contacts_) {
    const Face& face = faces_[contact.face];
    contact.touches &= !face.is_never_near;
    if (!contact.touches) continue;
    const double off = contact.gap - contact.floor;
    const bool holds = contact.impulse.dot(contact.n) > 0;
    is_off |= (holds ? std::abs(off) : -off) > SlackOf(placed, face);
  }
  return is_off;
}

// Of the points that touch in the end, from how they moved before the substep.
void PatchContacts::FindRebounds(const std::vector<PlacedCollider>& placed,
                                 const BodyNumbers& numbers) {
  for (Contact& contact : contacts_) {
    if (!contact.touches) continue;
    const Face& face = faces_[contact.face];
    const PlacedCollider& solid = placed[face.solid];
    const PlacedCollider& other = placed[face.other];
    const SurfaceDistance gap = GapAtStart(placed, contact);
    const Vector3d& n = gap.outward;
    const Vector3d touching =
        solid.start.PlaceOf(contact.spot.on_first) - contact.spot.round_of_first_m * n;
    const Vector3d relative = solid.start.VelocityAt(touching) - other.start.VelocityAt(touching);
    const double fall = FallOf(solid, other) * numbers.gravity_m_per_s2.dot(n);
    contact.rebound_m_per_s = ReboundSpeed(gap.distance_m, relative.dot(n), fall, numbers);
  }
}

}  // namespace drape::bodies
