#include <algorithm>
#include <mutex>

#include "base/buffer.h"
#include "base/error.h"
#include "reference/bands.h"
#include "reference/bounded_triangle.h"
#include "reference/oracle.h"

namespace rasterbench {
namespace {

using namespace reference;

template <class Real>
class Predictor {
 public:
  Predictor(const OracleInput<Real>& input, const OracleImage& oracle, const ModeBound& bound,
            Prediction& prediction)
      : input_(input),
        oracle_(oracle),
        bound_(bound),
        prediction_(prediction),
        far_(far_value(input.depth_function)),
        bands_(input.triangles, input.height, bound.snap + 1) {}

  void predict(int threads) {
    for_each_band(bands_.count(), threads, [&](int band) {
      const std::size_t first = pixel(0, bands_.first_row(band)), end = pixel(0, bands_.end_row(band));
      const std::vector<DepthInterval> owners = judge_owners(band);
      if (!bound_.exact_winner) judge_others(band, owners);
      std::int64_t pixels = 0;
      double error = 0;
      for (std::size_t i = first; i < end; ++i) {
        pixels += prediction_.reasons[i] != 0;
        if (prediction_.reasons[i] != 0 || oracle_.pieces[i] < 0) continue;
        const DepthInterval& depths = owners[i - first];
        error = std::max({error, depths.high - oracle_.values[i], oracle_.values[i] - depths.low});
      }
      const std::lock_guard lock(mutex_);
      prediction_.pixels += pixels;
      prediction_.max_depth_error = std::max(prediction_.max_depth_error, error);
    });
  }

 private:
  OracleTriangle triangle(std::int32_t index) const {
    return {input_.triangles[static_cast<std::size_t>(index)], input_.fill};
  }

  std::size_t pixel(int x, int y) const {
    return static_cast<std::size_t>(y) * static_cast<std::size_t>(input_.width) + static_cast<std::size_t>(x);
  }

  /// Calls visit(index, triangle, bounded, sample, pixel) for the samples that triangles of a band may cover.
  template <class Visit>
  void for_each_sample(int band, Visit visit) const {
    for (const std::int32_t index : bands_.triangles(band)) {
      const OracleTriangle exact = triangle(index);
      const BoundedTriangle bounded(exact, bound_, input_.depth_function);
      for (int y = bands_.first_row(band); y < bands_.end_row(band); ++y) {
        const Span span = bounded.span(y + 0.5, input_.width);
        for (int x = span.first; x < span.last; ++x)
          visit(index, exact, bounded, sample_of(x, y), pixel(x, y));
      }
    }
  }

  /// The depths that a mode may store for each owner, and whether it may miss it.
  std::vector<DepthInterval> judge_owners(int band) {
    const std::size_t first = pixel(0, bands_.first_row(band));
    std::vector<DepthInterval> owners(pixel(0, bands_.end_row(band)) - first, {far_, far_});
    OracleEffort ignored;
    for_each_sample(band, [&](std::int32_t index, const OracleTriangle&, const BoundedTriangle& bounded,
                              const ScreenPoint& sample, std::size_t i) {
      if (oracle_.pieces[i] != index) return;
      const DepthInterval depths = bounded.depths(sample);
      owners[i - first] = depths;
      if (bound_.exact_winner) return;
      if (!bounded.coverage(sample, ignored).must) prediction_.reasons[i] |= kEdgeCanFlip;
      if (depths.high >= far_) prediction_.reasons[i] |= kDepthCanFlip;
    });
    return owners;
  }

  /// Whether any other triangle may be drawn instead.
  void judge_others(int band, const std::vector<DepthInterval>& owners) {
    const std::size_t first = pixel(0, bands_.first_row(band));
    OracleEffort ignored;
    for_each_sample(band, [&](std::int32_t, const OracleTriangle& exact, const BoundedTriangle& bounded,
                              const ScreenPoint& sample, std::size_t i) {
      if (exact.id() == oracle_.ids[i]) return;
      const BoundedTriangle::Coverage coverage = bounded.coverage(sample, ignored);
      if (!coverage.may) return;
      const DepthInterval depths = bounded.depths(sample);
      const DepthInterval& owner = owners[i - first];
      const bool is_background = oracle_.pieces[i] < 0;
      if (is_background ? depths.low >= far_ : depths.low > owner.high) return;
      // Every mode puts the corners into one order first, so that triangles with the same corners have the
      // same bits, and their tie is decided by rank as the oracle does.
      if (!is_background && exact.same_corners(triangle(oracle_.pieces[i]))) return;
      if (!coverage.must) prediction_.reasons[i] |= kEdgeCanFlip;
      if (coverage.must || depths.high >= owner.low) prediction_.reasons[i] |= kDepthCanFlip;
    });
  }

  const OracleInput<Real>& input_;
  const OracleImage& oracle_;
  const ModeBound& bound_;
  Prediction& prediction_;
  double far_;
  Bands bands_;
  std::mutex mutex_;  // of the sums in prediction_
};

}  // namespace

template <class Real>
Prediction predict_wrong(const OracleInput<Real>& input, const OracleImage& oracle, const ModeBound& bound,
                         int threads) {
  if (oracle.width != input.width || oracle.height != input.height)
    throw Error("the oracle's picture and the input to predict from have different sizes");
  Prediction prediction;
  checked_bytes(oracle.ids.size(), 1, "the predicted pixels");
  prediction.reasons.assign(oracle.ids.size(), 0);
  Predictor<Real>(input, oracle, bound, prediction).predict(threads);
  return prediction;
}

template Prediction predict_wrong(const OracleInput<float>&, const OracleImage&, const ModeBound&, int);
template Prediction predict_wrong(const OracleInput<double>&, const OracleImage&, const ModeBound&, int);

}  // namespace rasterbench
