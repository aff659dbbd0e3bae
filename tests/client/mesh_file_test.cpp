#include "drape/mesh_file.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdlib>
#include <cstring>
#include <random>
#include <set>
#include <string>
#include <vector>

#include "tests/client/client_test_support.h"

namespace drape {
namespace {

using client_test::ErrorOf;
using client_test::TemporaryFolder;
using client_test::WriteText;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

template <class Element>
std::vector<Element> Unpack(const v1::PackedArray& array) {
  std::vector<Element> elements(array.data().size() / sizeof(Element));
  std::memcpy(elements.data(), array.data().data(), array.data().size());
  return elements;
}

class MeshFileTest : public ::testing::Test {
 protected:
  v1::Mesh Load(const std::string& obj, double scale_m = 1) {
    WriteText(folder_ / "mesh.obj", obj);
    return LoadMesh(folder_ / "mesh.obj", scale_m);
  }
  std::string Refusal(const std::string& obj) {
    const ErrorDetails details = ErrorOf([&] { Load(obj); });
    EXPECT_EQ(details.code, ErrorCode::kInvalidArgument);
    EXPECT_EQ(details.reason, "BAD_MESH_FILE");
    return details.message;
  }
  TemporaryFolder folder_;
};

TEST_F(MeshFileTest, ReadsInDoublePrecisionAndScales) {
  const v1::Mesh mesh = Load("v 0.1 0 0\nv 1 0 0\nv 0 1 0.123456789012\nf 1 2 3\n", 10);
  EXPECT_EQ(mesh.positions_m().data_type(), v1::PackedArray::FLOAT64);
  EXPECT_THAT(mesh.positions_m().shape(), ElementsAre(3u, 3u));
  EXPECT_THAT(mesh.triangles().shape(), ElementsAre(1u, 3u));
  EXPECT_THAT(Unpack<double>(mesh.positions_m()),
              ElementsAre(10 * 0.1, 0., 0., 10., 0., 0., 0., 10., 10 * 0.123456789012));
  EXPECT_THAT(Unpack<uint32_t>(mesh.triangles()), ElementsAre(0u, 1u, 2u));
}

// As Python does, so that both step the same numbers.
TEST_F(MeshFileTest, CoordinatesAreTheNearestNumbers) {
  std::mt19937_64 random(5);
  std::vector<double> coordinates;
  std::string obj;
  for (int vertex = 0; vertex < 1000; ++vertex) {
    obj += "v";
    for (int axis = 0; axis < 3; ++axis) {
      const std::string text = std::to_string(static_cast<double>(random() % 1000000) * 1e-4);
      coordinates.push_back(std::strtod(text.c_str(), nullptr));
      obj += " " + text;
    }
    obj += "\n";
  }
  EXPECT_EQ(Unpack<double>(Load(obj + "f 1 2 3\n").positions_m()), coordinates);
}

TEST_F(MeshFileTest, PolygonsBecomeFansFromTheirFirstCorner) {
  const v1::Mesh mesh =
      Load("v 0 0 0\nv 9 0 0\nv 9 0 1\nv 0 0 1\nv -1 0 0.5\nf 1 2 3 4\nf 1 2 3 4 5\n");
  EXPECT_THAT(Unpack<uint32_t>(mesh.triangles()),
              ElementsAre(0u, 1u, 2u, 0u, 2u, 3u, 0u, 1u, 2u, 0u, 2u, 3u, 0u, 3u, 4u));
}

// The two triangles share an edge, but neither texture coordinates nor normals along it.
TEST_F(MeshFileTest, SeamsDoNotTearTheMesh) {
  const v1::Mesh mesh = Load(
      "v 0 0 0\nv 1 0 0\nv 1 0 1\nv 0 0 1\n"
      "vt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\nvt 0.5 0.5\nvn 0 1 0\nvn 0 -1 0\n"
      "f 1/1/1 2/2/1 3/3/1\nf 1/5/2 3/5/2 4/4/2\n");
  EXPECT_THAT(mesh.positions_m().shape(), ElementsAre(4u, 3u));
  EXPECT_THAT(Unpack<uint32_t>(mesh.triangles()), ElementsAre(0u, 1u, 2u, 0u, 2u, 3u));
}

TEST_F(MeshFileTest, AllObjectsOfAFileAreOneMesh) {
  const v1::Mesh mesh =
      Load("o a\nv 0 0 0\nv 1 0 0\nv 0 0 1\nf 1 2 3\no b\nv 5 0 0\nv 6 0 0\nv 5 0 1\nf -3 -2 -1\n");
  EXPECT_THAT(Unpack<uint32_t>(mesh.triangles()), ElementsAre(0u, 1u, 2u, 3u, 4u, 5u));
}

// Skin weights, lines, tags and groups are none of ours, whatever is in them.
TEST_F(MeshFileTest, OtherStatementsAreLeftOut) {
  const v1::Mesh mesh = Load(
      "mtllib gone.mtl\nv 0 0 0\nvw 0 7e25 1\n  v 1 0 0\rl 1 99\nvt 0 0\nv 0 1 0\r\n"
      "t x 99999999999/1/1\ng a b\ns off\n\tf 1/1 2/1 3/-1\np 1e30\n");
  EXPECT_THAT(mesh.positions_m().shape(), ElementsAre(3u, 3u));
  EXPECT_THAT(Unpack<uint32_t>(mesh.triangles()), ElementsAre(0u, 1u, 2u));
}

TEST_F(MeshFileTest, RefusesWithAReason) {
  EXPECT_THAT(Refusal("v 0 0 0\nv 1 0 0\nv 0 0 1\n"), HasSubstr("no faces"));
  EXPECT_THAT(Refusal(""), HasSubstr("no faces"));
  EXPECT_THAT(Refusal("v 0 0 0\nv 1 0 0\nv 0 0 1\nf 1 2 7\n"), HasSubstr("vertex 7"));
  EXPECT_THAT(Refusal("v 0 0 0\nv 1 0 0\nv 0 0 1\nf 0 1 2\n"), HasSubstr("mesh.obj"));
}

TEST_F(MeshFileTest, EveryVertexHasThreeFiniteNumbers) {
  const std::string rest = "v 1 0 0\nv 0 0 1\nf 1 2 3\n";
  for (const char* vertex : {"v 0 nan 0", "v 0 0 inf", "v abc 0 0", "v 0 0", "v", "v 0 1,5 0"}) {
    EXPECT_THAT(Refusal(std::string("# head\r\n") + vertex + "\n" + rest), HasSubstr("line 2: "))
        << vertex;
  }
  // Blanks, signs, weights, colours.
  Load("  v\t+0  .5 -1.e-3 1\r\n" + rest);
  Load("v 0 0 0 0.5 0.5 0.5 \n" + rest);
}

TEST_F(MeshFileTest, SaysWhichFileIsMissing) {
  const ErrorDetails details = ErrorOf([&] { LoadMesh(folder_ / "nowhere.obj"); });
  EXPECT_EQ(details.code, ErrorCode::kNotFound);
  EXPECT_EQ(details.reason, "NO_MESH_FILE");
  EXPECT_THAT(details.message, HasSubstr("nowhere.obj"));
}

// Counts from the file's own head: 1809 vertices, 3448 faces.
TEST_F(MeshFileTest, ReadsTheSkirt) {
  const v1::Mesh mesh = LoadMesh(client_test::Example("meshes/skirt.obj"));
  EXPECT_THAT(mesh.positions_m().shape(), ElementsAre(1809u, 3u));
  EXPECT_THAT(mesh.triangles().shape(), ElementsAre(3448u, 3u));
}

// 16 rings of 6, 12, ... vertices around one: 1 + 6 * 16 * 17 / 2 = 817; 6 * 16^2 = 1536 triangles.
// Euler's formula for a disc: V - E + F = 1.
TEST_F(MeshFileTest, TheDiscIsADiscSeenFromAbove) {
  const v1::Mesh mesh = LoadMesh(client_test::Example("meshes/disc.obj"));
  const auto positions = Unpack<double>(mesh.positions_m());
  const auto triangles = Unpack<uint32_t>(mesh.triangles());
  ASSERT_EQ(positions.size(), 3u * 817);
  ASSERT_EQ(triangles.size(), 3u * 1536);
  std::set<std::pair<uint32_t, uint32_t>> edges;
  for (size_t t = 0; t < triangles.size(); t += 3) {
    const auto x = [&](size_t k) { return positions[3 * triangles[t + k]]; };
    const auto z = [&](size_t k) { return positions[3 * triangles[t + k] + 2]; };
    // y of the normal: (b - a) x (c - a).
    EXPECT_GT((z(1) - z(0)) * (x(2) - x(0)) - (x(1) - x(0)) * (z(2) - z(0)), 0) << t / 3;
    for (size_t k = 0; k < 3; ++k) {
      edges.insert(std::minmax(triangles[t + k], triangles[t + (k + 1) % 3]));
    }
  }
  EXPECT_EQ(817 - static_cast<int>(edges.size()) + 1536, 1);
}

}  // namespace
}  // namespace drape
