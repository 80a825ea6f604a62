#include "harness/explain.h"

#include <fmt/format.h>

#include <algorithm>
#include <boost/multiprecision/cpp_int.hpp>
#include <map>
#include <set>
#include <type_traits>

#include "numeric/modes.h"

namespace rasterbench {
namespace {

using Rational = boost::multiprecision::cpp_rational;

/// What one arithmetic makes of one screen triangle at one sample.
struct Claim {
  std::string arithmetic;
  bool covers = false;
  double edges[3] = {};  // positive inside; px^2, but for modes that work in normalised device coordinates
  double depth = 0;      // d
};

/// A screen triangle by the id of its triangle and its place among the pieces of that triangle.
struct Piece {
  std::int32_t id = -1;
  int number = 0;
  auto operator<=>(const Piece&) const = default;
};

template <class Real>
Claim exact_claim(const ScreenTriangle<Real>& triangle, int x, int y, FillRule fill) {
  const ScreenTriangle<Real> t = canonical(triangle);
  const auto cross = [&](int a, int b, const Rational& px, const Rational& py) -> Rational {
    return (Rational(t.x[b]) - Rational(t.x[a])) * (py - Rational(t.y[a])) -
           (Rational(t.y[b]) - Rational(t.y[a])) * (px - Rational(t.x[a]));
  };
  const Rational sx = Rational(x) + Rational(1, 2), sy = Rational(y) + Rational(1, 2);
  const Rational area = cross(0, 1, Rational(t.x[2]), Rational(t.y[2]));
  Claim claim{.arithmetic = "exact"};
  if (area == 0) return claim;
  claim.covers = true;
  Rational values[3];
  for (int e = 0; e < 3; ++e) {
    const bool flip = is_flipped(area < 0, e);
    const Rational value = cross(kEdgeFrom[e], kEdgeTo[e], sx, sy);
    values[e] = flip ? Rational(-value) : value;
    const double dx = (flip ? -1 : 1) * (double{t.x[kEdgeTo[e]]} - double{t.x[kEdgeFrom[e]]});
    const double dy = (flip ? -1 : 1) * (double{t.y[kEdgeTo[e]]} - double{t.y[kEdgeFrom[e]]});
    claim.covers &= values[e] > 0 || (values[e] == 0 && (fill == FillRule::kClosed || owns_edge(dx, dy)));
    claim.edges[e] = static_cast<double>(values[e]);
  }
  // Edge 12 is opposite corner 0, edge 02 opposite corner 1, edge 01 opposite corner 2.
  const Rational depth =
      (values[1] * Rational(t.d[0]) + values[2] * Rational(t.d[1]) + values[0] * Rational(t.d[2])) /
      abs(area);
  claim.depth = static_cast<double>(depth);
  return claim;
}

class Story {
 public:
  Story(Judge& judge, int x, int y) : judge_(judge), x_(x), y_(y) {}

  /// Looks at every screen triangle in one mode.
  template <NumericMode Mode>
  void tell() {
    judge_.with_screen(Mode::kInfo, [&](const auto& input, const auto&) {
      using Triangles = std::remove_cvref_t<decltype(input.triangles)>;
      if constexpr (std::is_same_v<typename Triangles::value_type, ScreenTriangle<typename Mode::Real>>)
        tell_of<Mode>(input.triangles);
    });
  }

  std::string text(const std::vector<std::string>& modes) const {
    std::string out =
        fmt::format("pixel x={} y={}, sample ({}, {})\n\nowner by\n", x_, y_, x_ + 0.5, y_ + 0.5);
    const auto pixel = static_cast<std::size_t>(y_) * static_cast<std::size_t>(judge_.settings().width) +
                       static_cast<std::size_t>(x_);
    const OracleImage& oracle = judge_.oracle(F32::kInfo);
    const std::int32_t exact = oracle.ids[pixel];
    out += owner_line("exact oracle (float32 vertices)", exact, exact);
    const EndToEndTruth& truth = judge_.truth();
    const bool ambiguous = truth.decided[pixel] == DecidedBy::kAmbiguous;
    out += owner_line(ambiguous ? "end-to-end truth (ambiguous)" : "end-to-end truth", truth.truth.ids[pixel],
                      exact);
    if (has_embree()) out += owner_line("Embree", judge_.rays(false).picture.ids[pixel], exact);
    for (const std::string& mode : modes) out += owner_line(mode, owners_.at(mode), exact);
    out += fmt::format("\nnearest edge that matters: {:.3g} px; depth gap to the runner-up: {:.3g}\n",
                       oracle.edge_margin[pixel], oracle.depth_gap[pixel]);
    for (const auto& [piece, claims] : claims_) {
      if (!wanted_.contains(piece)) continue;
      out += fmt::format("\ntriangle {}{}: {}\n", piece.id,
                         piece.number > 0 ? fmt::format(", piece {}", piece.number + 1) : "",
                         corners_.at(piece));
      out += fmt::format("  {:<24} {:>6} {:>24} {:>24} {:>24} {:>22}\n", "arithmetic", "claims", "edge 01",
                         "edge 12", "edge 02", "depth d");
      for (const Claim& c : claims)
        out += fmt::format("  {:<24} {:>6} {:>24.16g} {:>24.16g} {:>24.16g} {:>22.16g}\n", c.arithmetic,
                           c.covers ? "yes" : "no", c.edges[0], c.edges[1], c.edges[2], c.depth);
    }
    if (wanted_.empty()) out += "\nno triangle claims this pixel in any arithmetic\n";
    return out +
           "\nedges: 01, 12 and 02 of the corners in order of (x, y), positive inside, in px^2 "
           "(two_product: in normalised device coordinates, of the corners as given)\n";
  }

 private:
  static std::string owner_line(const std::string& who, std::int32_t id, std::int32_t exact) {
    return fmt::format("  {:<34} {}{}\n", who, id < 0 ? "background" : fmt::format("triangle {}", id),
                       id == exact ? "" : "   <- differs");
  }

  /// Whether the sample is within a pixel and a half of the triangle's box: no mode errs by more.
  template <class Real>
  bool is_near(const ScreenTriangle<Real>& t) const {
    const auto [low_x, high_x] = std::minmax({t.x[0], t.x[1], t.x[2]});
    const auto [low_y, high_y] = std::minmax({t.y[0], t.y[1], t.y[2]});
    return low_x - 1 <= static_cast<Real>(x_ + 1) && high_x + 1 >= static_cast<Real>(x_) &&
           low_y - 1 <= static_cast<Real>(y_ + 1) && high_y + 1 >= static_cast<Real>(y_);
  }

  template <NumericMode Mode>
  void tell_of(std::span<const ScreenTriangle<typename Mode::Real>> triangles) {
    const std::string name(Mode::kInfo.name);
    const FrameSettings& settings = judge_.settings();
    const DepthMap map = depth_map(judge_.camera(), Mode::kDepthFunction);
    const auto count = static_cast<std::int64_t>(judge_.scene().model.triangles.size());
    typename Mode::Key nearest = Mode::kClear;
    std::int32_t owner = -1;
    std::map<std::int32_t, int> pieces;
    for (const auto& triangle : triangles) {
      if (triangle.id < 0) continue;
      const Piece piece{triangle.id, pieces[triangle.id]++};
      if (!is_near(triangle)) continue;
      const auto rank = swap_rank(settings.tie, count, static_cast<std::uint32_t>(triangle.id));
      const auto prepared = Mode::prepare(triangle, settings.grid(), rank);
      Claim claim{.arithmetic = name, .covers = covers<Mode>(prepared, x_, y_)};
      for (int e = 0; e < 3; ++e) claim.edges[e] = static_cast<double>(Mode::edge_value(prepared, e, x_, y_));
      const auto key = Mode::key(Mode::depth(prepared, x_, y_), rank);
      claim.depth = map.offset + map.scale * Mode::value(key);
      if (claim.covers && key < nearest) {
        nearest = key;
        owner = triangle.id;
      }
      auto& claims = claims_[piece];
      // Modes of float64 vertices are given other corners, hence another truth.
      const std::string exact = std::is_same_v<typename Mode::Real, double> ? "exact, float64" : "exact";
      if (std::none_of(claims.begin(), claims.end(), [&](const Claim& c) { return c.arithmetic == exact; })) {
        claims.push_back(exact_claim(triangle, x_, y_, settings.fill));
        claims.back().arithmetic = exact;
        claims.back().depth = map.offset + map.scale * claims.back().depth;
        if (claims.back().covers) wanted_.insert(piece);
        corners_[piece] =
            fmt::format("({:.9g}, {:.9g}, d {:.9g}) ({:.9g}, {:.9g}, d {:.9g}) ({:.9g}, {:.9g}, d {:.9g}) px",
                        triangle.x[0], triangle.y[0], map.offset + map.scale * triangle.d[0], triangle.x[1],
                        triangle.y[1], map.offset + map.scale * triangle.d[1], triangle.x[2], triangle.y[2],
                        map.offset + map.scale * triangle.d[2]);
      }
      claims.push_back(claim);
      if (claim.covers) wanted_.insert(piece);
    }
    owners_[name] = owner;
  }

  Judge& judge_;
  int x_, y_;
  std::map<Piece, std::vector<Claim>> claims_;
  std::map<Piece, std::string> corners_;
  std::set<Piece> wanted_;
  std::map<std::string, std::int32_t> owners_;
};

}  // namespace

std::string explain_pixel(Judge& judge, const std::vector<std::string>& modes, int x, int y) {
  Story story(judge, x, y);
  std::vector<std::string> told;
  for_each_mode([&]<NumericMode Mode>() {
    if (std::find(modes.begin(), modes.end(), Mode::kInfo.name) == modes.end()) return;
    told.emplace_back(Mode::kInfo.name);
    story.tell<Mode>();
  });
  return story.text(told);
}

}  // namespace rasterbench
