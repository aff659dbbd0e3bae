#include "client/cli/usda_parts.h"

#include <numeric>
#include <span>
#include <utility>

#include "client/cli/geometry_writer.h"

namespace drape::cli {
namespace {

// Thickness of drawn curves and points [m].
constexpr float kRadius = 0.0025f;

// "        type name = value\n"
void AppendAttribute(const std::string& declaration, const std::string& value, std::string* text) {
  *text += "        " + declaration + " = " + value + "\n";
}

std::string ArrayText(std::span<const uint32_t> numbers) {
  std::string text = "[";
  for (const uint32_t number : numbers) {
    if (text.size() > 1) text += ", ";
    AppendNumber(uint64_t{number}, &text);
  }
  return text + "]";
}

// The particle of each point, for prims whose points are not all the particles in order.
void AppendParticles(const UsdaPart& part, std::string* text) {
  AppendAttribute("int[] primvars:particle", ArrayText(part.particles) + " (", text);
  *text += "            interpolation = \"vertex\"\n        )\n";
}

void MakeThick(UsdaPart* part) {
  part->radius_m = kRadius;
  std::string width;
  AppendNumber(2 * kRadius, &width);
  AppendAttribute("float[] widths", "[" + width + "] (", &part->attributes);
  part->attributes += "            interpolation = \"constant\"\n        )\n";
}

UsdaPart MeshPart(const Topology& topology, size_t particle_count) {
  UsdaPart part;
  part.type = "Mesh";
  part.particles.resize(particle_count);
  std::iota(part.particles.begin(), part.particles.end(), 0u);
  std::vector<uint32_t> indices;
  for (const auto& triangle : topology.triangles) {
    indices.insert(indices.end(), triangle.begin(), triangle.end());
  }
  const std::vector<uint32_t> counts(topology.triangles.size(), 3);
  AppendAttribute("uniform bool doubleSided", "1", &part.attributes);
  AppendAttribute("int[] faceVertexCounts", ArrayText(counts), &part.attributes);
  AppendAttribute("int[] faceVertexIndices", ArrayText(indices), &part.attributes);
  AppendAttribute("uniform token subdivisionScheme", "\"none\"", &part.attributes);
  return part;
}

// A curve continues while each line begins where the last one ended.
UsdaPart CurvesPart(const Topology& topology) {
  UsdaPart part;
  part.type = "BasisCurves";
  std::vector<uint32_t> counts;
  for (const auto& [from, to] : topology.lines) {
    if (part.particles.empty() || part.particles.back() != from) {
      part.particles.push_back(from);
      counts.push_back(1);
    }
    part.particles.push_back(to);
    ++counts.back();
  }
  AppendAttribute("int[] curveVertexCounts", ArrayText(counts), &part.attributes);
  AppendParticles(part, &part.attributes);
  AppendAttribute("uniform token type", "\"linear\"", &part.attributes);
  MakeThick(&part);
  return part;
}

UsdaPart PointsPart(std::vector<uint32_t> particles) {
  UsdaPart part;
  part.type = "Points";
  part.particles = std::move(particles);
  AppendParticles(part, &part.attributes);
  MakeThick(&part);
  return part;
}

std::vector<uint32_t> ParticlesWithoutLine(const Topology& topology, size_t particle_count) {
  std::vector<bool> has_line(particle_count);
  for (const auto& [from, to] : topology.lines) has_line.at(from) = has_line.at(to) = true;
  std::vector<uint32_t> particles;
  for (uint32_t particle = 0; particle < particle_count; ++particle) {
    if (!has_line[particle]) particles.push_back(particle);
  }
  return particles;
}

}  // namespace

std::vector<UsdaPart> UsdaParts(const States& states, const std::vector<Topology>& topologies) {
  std::vector<UsdaPart> parts;
  for (size_t cloth = 0; cloth < states.size(); ++cloth) {
    const Topology& topology = TopologyAt(topologies, cloth);
    const auto add = [&](UsdaPart part, const char* suffix) {
      part.cloth = cloth;
      part.name = "cloth_" + std::to_string(cloth) + suffix;
      parts.push_back(std::move(part));
    };
    const size_t particle_count = states[cloth].particle_count;
    if (!topology.triangles.empty()) {
      add(MeshPart(topology, particle_count), "");
      continue;
    }
    if (!topology.lines.empty()) add(CurvesPart(topology), "");
    std::vector<uint32_t> loose = ParticlesWithoutLine(topology, particle_count);
    if (!loose.empty()) add(PointsPart(std::move(loose)), topology.lines.empty() ? "" : "_loose");
  }
  return parts;
}

}  // namespace drape::cli
