#include "drape/mesh_file.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <fstream>
#include <iterator>
#include <optional>
#include <sstream>
#include <string>
#include <string_view>
#include <system_error>
#include <utility>
#include <vector>

#include "client/src/errors.h"

#define TINYOBJLOADER_IMPLEMENTATION
#define TINYOBJLOADER_USE_DOUBLE
// A namespace of its own separates this double-precision copy from the single-precision one in the
// shared library.
#define tinyobj drape_tinyobj
#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wconversion"
#pragma GCC diagnostic ignored "-Wshadow"
#include <tiny_obj_loader.h>
#pragma GCC diagnostic pop

namespace drape {
inline namespace client {
namespace {

Error BadMesh(const std::filesystem::path& path, const std::string& what) {
  return LocalError(ErrorCode::kInvalidArgument, "BAD_MESH_FILE",
                    "mesh file " + path.string() + ": " + what);
}

template <class Element>
v1::PackedArray Pack(v1::PackedArray::DataType type, const std::vector<Element>& elements) {
  v1::PackedArray array;
  array.set_data_type(type);
  array.add_shape(static_cast<uint32_t>(elements.size() / 3));
  array.add_shape(3);
  array.set_data(elements.data(), elements.size() * sizeof(Element));
  return array;
}

// The fan triangles of every polygon of `mesh`, appended.
void AppendFans(const tinyobj::mesh_t& mesh, size_t vertex_count, const std::filesystem::path& path,
                std::vector<uint32_t>* triangles) {
  size_t first = 0;
  for (size_t face = 0; face < mesh.num_face_vertices.size(); ++face) {
    const size_t corner_count = mesh.num_face_vertices[face];
    for (size_t corner = 0; corner < corner_count; ++corner) {
      const int vertex = mesh.indices[first + corner].vertex_index;
      if (vertex < 0 || static_cast<size_t>(vertex) >= vertex_count) {
        throw BadMesh(path, "a face names vertex " + std::to_string(vertex + 1) +
                                ", but there are " + std::to_string(vertex_count));
      }
    }
    for (size_t corner = 2; corner < corner_count; ++corner) {
      for (const size_t of : {size_t{0}, corner - 1, corner}) {
        triangles->push_back(static_cast<uint32_t>(mesh.indices[first + of].vertex_index));
      }
    }
    first += corner_count;
  }
  // The loader counts the corners of a face in 8 bits.
  if (first != mesh.indices.size()) throw BadMesh(path, "a face has more than 255 corners");
}

// Removes the text before the next blank from `line` and returns it.
std::string_view TakeWord(std::string_view* line) {
  line->remove_prefix(std::min(line->find_first_not_of(" \t"), line->size()));
  const std::string_view word = line->substr(0, line->find_first_of(" \t"));
  line->remove_prefix(word.size());
  return word;
}

std::optional<double> FiniteNumber(std::string_view word) {
  if (word.starts_with('+')) word.remove_prefix(1);
  double value = 0;
  const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), value);
  const bool is_number = error == std::errc() && end == word.data() + word.size();
  return is_number && std::isfinite(value) ? std::optional(value) : std::nullopt;
}

struct Geometry {
  // The statements of the file that faces need, each on its line; the others may hold what the
  // loader takes for numbers without a look at their range.
  std::string statements;
  // [vertex_count][3]: the nearest numbers to those of the file, which the loader's are not.
  std::vector<double> vertices;
};

// Refuses incomplete vertices, which the loader would complete with zeros.
Geometry ReadGeometry(const std::filesystem::path& path) {
  std::ifstream file(path, std::ios::binary);
  const std::string text(std::istreambuf_iterator<char>(file), {});
  Geometry geometry;
  size_t line_number = 1;
  for (size_t begin = 0; begin < text.size(); ++line_number) {
    const size_t end = std::min(text.find_first_of("\r\n", begin), text.size());
    const std::string_view whole = std::string_view(text).substr(begin, end - begin);
    begin = end + (text.compare(end, 2, "\r\n") == 0 ? 2 : 1);
    std::string_view line = whole;
    const std::string_view statement = TakeWord(&line);
    if (statement == "v" || statement == "vt" || statement == "vn" || statement == "f") {
      geometry.statements += whole;
    }
    geometry.statements += '\n';
    if (statement != "v") continue;
    for (int axis = 0; axis < 3; ++axis) {
      const std::string_view word = TakeWord(&line);
      if (const std::optional<double> coordinate = FiniteNumber(word)) {
        geometry.vertices.push_back(*coordinate);
        continue;
      }
      throw BadMesh(path, "line " + std::to_string(line_number) + ": a vertex needs three finite " +
                              "numbers, got " + (word.empty() ? "fewer" : std::string(word)));
    }
  }
  return geometry;
}

}  // namespace

v1::Mesh LoadMesh(const std::filesystem::path& path, double scale_m) {
  if (!std::filesystem::is_regular_file(path)) {
    throw LocalError(ErrorCode::kNotFound, "NO_MESH_FILE", "no mesh file " + path.string());
  }
  Geometry geometry = ReadGeometry(path);
  std::istringstream statements(geometry.statements);
  tinyobj::attrib_t attributes;
  std::vector<tinyobj::shape_t> shapes;
  std::vector<tinyobj::material_t> materials;
  std::string warning;
  std::string error;
  // The loader does not triangulate here, because it splits quads along the shorter diagonal.
  const bool is_read = tinyobj::LoadObj(&attributes, &shapes, &materials, &warning, &error,
                                        &statements, nullptr, /*triangulate=*/false);
  if (!is_read) throw BadMesh(path, error.empty() ? "not a Wavefront OBJ file" : error);

  const size_t vertex_count = geometry.vertices.size() / 3;
  std::vector<uint32_t> triangles;
  for (const tinyobj::shape_t& shape : shapes) {
    AppendFans(shape.mesh, vertex_count, path, &triangles);
  }
  if (triangles.empty()) throw BadMesh(path, "it has no faces");
  for (double& coordinate : geometry.vertices) coordinate *= scale_m;

  v1::Mesh mesh;
  *mesh.mutable_positions_m() = Pack(v1::PackedArray::FLOAT64, geometry.vertices);
  *mesh.mutable_triangles() = Pack(v1::PackedArray::UINT32, triangles);
  return mesh;
}

}  // namespace client
}  // namespace drape
