// Writes the examples that are too long to write by hand: make_examples DIR fills DIR like
// client/examples. Needs DIR/meshes/skirt.obj for the skirt. A test compares.
#include <array>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <cstring>
#include <exception>
#include <filesystem>
#include <fstream>
#include <map>
#include <numbers>
#include <string>
#include <vector>

#include "client/examples/json_layout.h"
#include "drape/mesh_file.h"

namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

// Rounded to a tenth of a millimetre: more than enough for a start, and short in the file. Adding 0
// turns -0 into 0.
double Rounded(double value) {
  return std::round(value * 1e4) / 1e4 + 0.0;
}

Json Pins(const std::vector<uint32_t>& particles) {
  Json pins = Json::array();
  for (const uint32_t particle : particles) pins.push_back({{"particle", particle}});
  return pins;
}

void Write(const fs::path& path, const std::string& text) {
  std::ofstream file(path, std::ios::binary);
  file << text;
  if (!file.flush()) throw std::runtime_error("cannot write " + path.string());
}

// 64 curtains in rows of 8, each under its own gravity: each a little stronger and more tilted than
// the last, so that no two move in the same way.
Json ManyCloths() {
  Json cloths = Json::array();
  for (int k = 0; k < 64; ++k) {
    const double tilt = (k - 31.5) / 64;  // [rad]
    const double strength = 8 + 0.05 * k;
    cloths.push_back(
        {{"spec",
          {{"grid", {{"columns", 32}, {"rows", 32}, {"width_m", 1}, {"height_m", 1}}},
           {"transform", {{"position_m", {1.5 * (k % 8), 0, 1.5 * (k / 8)}}}},
           {"material", {{"damping_per_s", 0.2}}},
           {"pins", Pins({0, 31})},
           {"environment",
            {{"gravity_m_per_s2",
              {Rounded(strength * std::sin(tilt)), Rounded(-strength * std::cos(tilt)), 0}}}}}}});
  }
  return {{"name", "many_cloths"}, {"duration_s", 3}, {"cloths", cloths}};
}

// Beads on a thread that sags between two pins; then one end is carried towards the other. (Rest
// lengths come from the rest shape: a straight one would be taut and could not move at all.)
Json Chain() {
  constexpr uint32_t kBeads = 41;
  Json positions = Json::array();
  Json masses = Json::array();
  Json constraints = Json::array();
  for (uint32_t bead = 0; bead < kBeads; ++bead) {
    const double along = 2.0 * bead / (kBeads - 1) - 1;  // -1 to 1
    for (const double coordinate : {0.8 * (along + 1), 0.5 * (along * along - 1), 0.0}) {
      positions.push_back(Rounded(coordinate));
    }
    masses.push_back(0.01);
    if (bead > 0) constraints.push_back({{"i", bead - 1}, {"j", bead}});
  }
  const Json spec = {
      {"particles",
       {{"positions_m", positions}, {"masses_kg", masses}, {"distance_constraints", constraints}}},
      {"material", {{"damping_per_s", 0.5}}},
      {"pins", Pins({0, kBeads - 1})}};
  const Json target = {{"particle", kBeads - 1}, {"target_m", {0.8, 0, 0}}, {"over_s", 1}};
  return {{"name", "chain"},
          {"duration_s", 4},
          {"cloths", {{{"spec", spec}}}},
          {"controls", {{{"time_s", 0.5}, {"pin_targets", {target}}}}}};
}

// A square net held by its corners, with slightly elastic threads. Its middle weighs as much as all
// the knots of two rows.
Json Net() {
  constexpr uint32_t kKnots = 17;  // per side
  Json positions = Json::array();
  Json masses = Json::array();
  Json constraints = Json::array();
  const auto connect = [&constraints](uint32_t i, uint32_t j) {
    constraints.push_back({{"i", i}, {"j", j}, {"compliance_m_per_n", 1e-4}});
  };
  for (uint32_t row = 0; row < kKnots; ++row) {
    for (uint32_t column = 0; column < kKnots; ++column) {
      const uint32_t knot = row * kKnots + column;
      const double sag = 0.4 * std::sin(std::numbers::pi * column / (kKnots - 1)) *
                         std::sin(std::numbers::pi * row / (kKnots - 1));
      for (const double coordinate : {0.1 * column, -sag, 0.1 * row}) {
        positions.push_back(Rounded(coordinate));
      }
      masses.push_back(row == kKnots / 2 && column == kKnots / 2 ? 0.34 : 0.01);
      if (column > 0) connect(knot - 1, knot);
      if (row > 0) connect(knot - kKnots, knot);
    }
  }
  const Json spec = {
      {"particles",
       {{"positions_m", positions}, {"masses_kg", masses}, {"distance_constraints", constraints}}},
      {"material", {{"damping_per_s", 0.5}}},
      {"pins", Pins({0, kKnots - 1, kKnots * (kKnots - 1), kKnots * kKnots - 1})}};
  return {{"name", "net"}, {"duration_s", 3}, {"cloths", {{{"spec", spec}}}}};
}

// A flag held along its hoist, in the xy plane. The wind blows past it, and from 3 s on across.
Json Flag() {
  constexpr uint32_t kColumns = 37, kRows = 25;
  std::vector<uint32_t> hoist;
  for (uint32_t row = 0; row < kRows; ++row) hoist.push_back(row * kColumns);
  const Json spec = {
      {"grid", {{"columns", kColumns}, {"rows", kRows}, {"width_m", 1.5}, {"height_m", 1}}},
      {"transform", {{"rotation_xyzw", {1, 0, 0, 1}}}},
      {"material",
       {{"areal_density_kg_per_m2", 0.1},
        {"shear_stiffness_n_per_m", 5},
        {"bending_stiffness_n_per_m", 0.05},
        {"damping_per_s", 0.1},
        {"air_drag", 1.2},
        {"air_lift", 1}}},
      {"pins", Pins(hoist)},
      {"environment", {{"wind_m_per_s", {6, 0, 0.3}}}}};
  return {{"name", "flag"},
          {"duration_s", 6},
          {"cloths", {{{"spec", spec}}}},
          {"controls", {{{"time_s", 3}, {"wind_m_per_s", {4, 0, 4.5}}}}}};
}

// Five sheets one above the other, each turned a little more, fall on a sphere.
Json FiveSheets() {
  constexpr double kSide_m = 0.9;
  const Json colliders = {{{"sphere", {{"center_m", {0, 0, 0}}, {"radius_m", 0.25}}}},
                          {{"plane", {{"point_m", {0, -0.35, 0}}, {"normal", {0, 1, 0}}}}}};
  Json cloths = Json::array();
  for (int k = 0; k < 5; ++k) {
    const double angle = 0.18 * k;  // about y
    const double x = kSide_m / 2 * (std::cos(angle) + std::sin(angle));
    const double z = kSide_m / 2 * (std::cos(angle) - std::sin(angle));
    const Json turned = {0, Rounded(std::sin(angle / 2)), 0, Rounded(std::cos(angle / 2))};
    cloths.push_back(
        {{"world", "stack"},
         {"spec",
          {{"grid", {{"columns", 25}, {"rows", 25}, {"width_m", kSide_m}, {"height_m", kSide_m}}},
           {"transform",
            {{"position_m", {Rounded(-x), Rounded(0.28 + 0.03 * k), Rounded(-z)}},
             {"rotation_xyzw", turned}}},
           {"material",
            {{"areal_density_kg_per_m2", 0.2},
             {"bending_rigidity_n_m", 2e-4},
             {"damping_per_s", 0.5},
             {"friction_static", 0.4},
             {"friction_dynamic", 0.3},
             {"thickness_m", 0.006}}},
           {"environment", {{"colliders", colliders}}},
           {"self_collision", Json::object()}}}});
  }
  return {{"name", "five_sheets"}, {"duration_s", 2}, {"cloths", cloths}};
}

// A tube of triangles about y, whose lower rim is turned once around while the upper one is held.
constexpr uint32_t kTubeColumns = 24, kTubeRows = 25;
constexpr double kTubeRadius_m = 0.12, kTubeHeight_m = 0.5;

std::array<double, 3> TubePlace(uint32_t row, double column) {
  const double angle = 2 * std::numbers::pi * column / kTubeColumns;
  return {Rounded(kTubeRadius_m * std::cos(angle)),
          Rounded(kTubeHeight_m * (1 - row / (kTubeRows - 1.0))),
          Rounded(kTubeRadius_m * std::sin(angle))};
}

std::string TubeObj() {
  std::string text = "# A tube, metres. Made by make_examples.cpp.\n";
  char line[80];
  for (uint32_t row = 0; row < kTubeRows; ++row) {
    for (uint32_t column = 0; column < kTubeColumns; ++column) {
      // Every other row by half a column, so that no direction is preferred.
      const auto [x, y, z] = TubePlace(row, column + 0.5 * (row % 2));
      std::snprintf(line, sizeof(line), "v %.4f %.4f %.4f\n", x, y, z);
      text += line;
    }
  }
  const auto vertex = [](uint32_t row, uint32_t column) {
    return 1 + row * kTubeColumns + column % kTubeColumns;
  };
  const auto add_face = [&](uint32_t a, uint32_t b, uint32_t c) {
    std::snprintf(line, sizeof(line), "f %u %u %u\n", a, b, c);
    text += line;
  };
  for (uint32_t row = 0; row + 1 < kTubeRows; ++row) {
    const uint32_t shift = row % 2;
    for (uint32_t column = 0; column < kTubeColumns; ++column) {
      add_face(vertex(row, column), vertex(row, column + 1), vertex(row + 1, column + shift));
      add_face(vertex(row + 1, column), vertex(row, column + 1 - shift),
               vertex(row + 1, column + 1));
    }
  }
  return text;
}

// In sixteen straight motions of the pins; the rims come nearer to each other meanwhile.
Json TwistedTube() {
  constexpr int kMotions = 16;
  constexpr double kRise_m = 0.3;
  Json pins = Json::array(), controls = Json::array();
  const uint32_t lowest = (kTubeRows - 1) * kTubeColumns;
  for (const uint32_t first : {0u, lowest}) {
    for (uint32_t k = 0; k < kTubeColumns; ++k) pins.push_back({{"particle", first + k}});
  }
  for (int motion = 1; motion <= kMotions; ++motion) {
    Json targets = Json::array();
    for (uint32_t k = 0; k < kTubeColumns; ++k) {
      const double share = static_cast<double>(motion) / kMotions;
      const auto [x, y, z] = TubePlace(kTubeRows - 1, k + share * kTubeColumns);
      targets.push_back({{"particle", lowest + k},
                         {"target_m", {x, Rounded(y + kRise_m * share), z}},
                         {"over_s", 0.15}});
    }
    controls.push_back({{"time_s", Rounded(0.15 * motion)}, {"pin_targets", targets}});
  }
  const Json spec = {{"mesh_file", "meshes/tube.obj"},
                     {"scale_m", 1},
                     {"material",
                      {{"areal_density_kg_per_m2", 0.2},
                       {"stretch_stiffness_n_per_m", 300},
                       {"bending_rigidity_n_m", 1e-5},
                       {"damping_per_s", 0.5},
                       {"friction_static", 0.3},
                       {"friction_dynamic", 0.25},
                       {"thickness_m", 0.002}}},
                     {"pins", pins},
                     {"self_collision", Json::object()}};
  return {{"name", "twisted_tube"},
          {"duration_s", 3},
          {"cloths", {{{"spec", spec}}}},
          {"controls", controls}};
}

struct Vertices {
  std::vector<std::array<double, 3>> positions;
  std::vector<std::array<uint32_t, 3>> triangles;
};

Vertices Unpack(const drape::v1::Mesh& mesh) {
  Vertices vertices;
  const std::string& positions = mesh.positions_m().data();
  vertices.positions.resize(positions.size() / sizeof(vertices.positions[0]));
  std::memcpy(vertices.positions.data(), positions.data(), positions.size());
  const std::string& triangles = mesh.triangles().data();
  vertices.triangles.resize(triangles.size() / sizeof(vertices.triangles[0]));
  std::memcpy(vertices.triangles.data(), triangles.data(), triangles.size());
  return vertices;
}

// The vertices of the highest boundary loop, in order around it.
std::vector<uint32_t> HighestLoop(const Vertices& mesh) {
  std::map<std::pair<uint32_t, uint32_t>, int> uses;  // of each directed edge
  for (const auto& triangle : mesh.triangles) {
    for (size_t k = 0; k < 3; ++k) ++uses[{triangle[k], triangle[(k + 1) % 3]}];
  }
  std::map<uint32_t, uint32_t> next;  // along the boundary
  for (const auto& [edge, count] : uses) {
    if (!uses.contains({edge.second, edge.first})) next[edge.first] = edge.second;
  }
  std::vector<uint32_t> highest;
  double highest_mean = -1e300;
  while (!next.empty()) {
    std::vector<uint32_t> loop;
    double sum = 0;
    for (auto it = next.begin(); it != next.end(); it = next.find(loop.back())) {
      loop.push_back(it->second);
      sum += mesh.positions[it->second][1];
      next.erase(it);
    }
    const double mean = sum / static_cast<double>(loop.size());
    if (mean > highest_mean) highest = loop;
    highest_mean = std::max(highest_mean, mean);
  }
  return highest;
}

Json WaistMove(const Vertices& mesh, const std::vector<uint32_t>& waist, double time_s,
               double shift_m) {
  Json targets = Json::array();
  for (const uint32_t particle : waist) {
    const auto& position = mesh.positions[particle];
    targets.push_back(
        {{"particle", particle},
         {"target_m", {Rounded(position[0] + shift_m), Rounded(position[1]), Rounded(position[2])}},
         {"over_s", 0.3}});
  }
  return {{"time_s", time_s}, {"pin_targets", targets}};
}

// The waist is carried to one side and back.
Json Skirt(const fs::path& mesh_file) {
  const Vertices mesh = Unpack(drape::LoadMesh(mesh_file));
  const std::vector<uint32_t> waist = HighestLoop(mesh);
  const Json spec = {{"mesh_file", "meshes/skirt.obj"},
                     {"scale_m", 1},
                     {"material",
                      {{"areal_density_kg_per_m2", 0.25},
                       {"bending_stiffness_n_per_m", 0.2},
                       {"damping_per_s", 0.5}}},
                     {"pins", Pins(waist)}};
  return {{"name", "skirt"},
          {"duration_s", 3},
          {"cloths", {{{"spec", spec}}}},
          {"controls", {WaistMove(mesh, waist, 1, 0.1), WaistMove(mesh, waist, 1.5, 0)}}};
}

// A disc of radius 0.5 m: rings of 6, 12, 18, ... vertices around a centre, each vertex displaced
// by less than a quarter of the distance between rings.
std::string DiscObj() {
  constexpr uint32_t kRings = 16;
  constexpr double kSpacing = 0.5 / kRings;
  uint32_t seed = 1;
  const auto jitter = [&seed] {  // Numerical Recipes' generator; its upper bits, in [-1, 1)
    seed = seed * 1664525u + 1013904223u;
    return 0.2 * kSpacing * (static_cast<double>(seed >> 8) / (1 << 23) - 1);
  };
  std::string text = "# A disc of irregular triangles, metres. Made by make_examples.cpp.\n";
  char line[80];
  const auto add_vertex = [&](double radius, double angle) {
    std::snprintf(line, sizeof(line), "v %.5f 0 %.5f\n", radius * std::cos(angle) + jitter(),
                  radius * std::sin(angle) + jitter());
    text += line;
  };
  add_vertex(0, 0);
  for (uint32_t ring = 1; ring <= kRings; ++ring) {
    for (uint32_t k = 0; k < 6 * ring; ++k) {
      add_vertex(kSpacing * ring, 2 * std::numbers::pi * k / (6 * ring));
    }
  }
  // Vertex k of a ring; ring 0 is the centre. Numbers of the file count from 1.
  const auto vertex = [](uint32_t ring, uint32_t k) {
    return ring == 0 ? 1u : 2 + 3 * ring * (ring - 1) + k % (6 * ring);
  };
  const auto add_face = [&](uint32_t a, uint32_t b, uint32_t c) {
    std::snprintf(line, sizeof(line), "f %u %u %u\n", a, b, c);
    text += line;
  };
  // Each of the six sectors of a ring has `ring` triangles whose base is on it and ring - 1 whose
  // base is on the ring inside. Seen from above (+y), angles from x to z run clockwise.
  for (uint32_t ring = 1; ring <= kRings; ++ring) {
    for (uint32_t sector = 0; sector < 6; ++sector) {
      for (uint32_t k = 0; k < ring; ++k) {
        const uint32_t outer = sector * ring + k;
        const uint32_t inner = sector * (ring - 1) + k;
        add_face(vertex(ring, outer), vertex(ring - 1, inner), vertex(ring, outer + 1));
        if (k + 1 == ring) continue;
        add_face(vertex(ring - 1, inner), vertex(ring - 1, inner + 1), vertex(ring, outer + 1));
      }
    }
  }
  return text;
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 2) {
    std::fprintf(stderr, "usage: make_examples DIR\n");
    return 2;
  }
  const fs::path folder = argv[1];
  try {
    Write(folder / "many_cloths.json", LayOutJson(ManyCloths()));
    Write(folder / "chain.json", LayOutJson(Chain()));
    Write(folder / "net.json", LayOutJson(Net()));
    Write(folder / "flag.json", LayOutJson(Flag()));
    Write(folder / "five_sheets.json", LayOutJson(FiveSheets()));
    Write(folder / "twisted_tube.json", LayOutJson(TwistedTube()));
    Write(folder / "meshes" / "tube.obj", TubeObj());
    Write(folder / "skirt.json", LayOutJson(Skirt(folder / "meshes" / "skirt.obj")));
    Write(folder / "meshes" / "disc.obj", DiscObj());
  } catch (const std::exception& error) {
    std::fprintf(stderr, "make_examples: %s\n", error.what());
    return 1;
  }
  return 0;
}
