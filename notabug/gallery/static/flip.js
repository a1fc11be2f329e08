"use strict";
// FLIP of two linear pictures: Andersson et al. 2020, "FLIP: A Difference Evaluator for Alternating Images", HPG.
// The same constants as the judge: 67 pixels per degree, low dynamic range at one fixed exposure.
globalThis.flip = (() => {
  const PPD = 67;
  const WHITE = [0.950428545, 1.0, 1.088900371];
  const TO_XYZ = [
    [10135552 / 24577794, 8788810 / 24577794, 4435075 / 24577794],
    [2613072 / 12288897, 8788810 / 12288897, 887015 / 12288897],
    [1425312 / 73733382, 8788810 / 73733382, 70074185 / 73733382],
  ];
  const FROM_XYZ = inverse(TO_XYZ);
  const DELTA = 6 / 29;

  function inverse(m) {
    const [[a, b, c], [d, e, f], [g, h, i]] = m;
    const det = a * (e * i - f * h) - b * (d * i - f * g) + c * (d * h - e * g);
    return [
      [(e * i - f * h) / det, (c * h - b * i) / det, (b * f - c * e) / det],
      [(f * g - d * i) / det, (a * i - c * g) / det, (c * d - a * f) / det],
      [(d * h - e * g) / det, (b * g - a * h) / det, (a * e - b * d) / det],
    ];
  }
  const times = (m, r, g, b) => m.map((row) => row[0] * r + row[1] * g + row[2] * b);
  const f = (t) => (t > DELTA ** 3 ? Math.cbrt(t) : t / (3 * DELTA * DELTA) + 4 / 29);

  function hunt(r, g, b) { // L*, and a*, b* weighted by it
    const [x, y, z] = times(TO_XYZ, r, g, b).map((v, i) => f(v / WHITE[i]));
    const l = 116 * y - 16;
    return [l, 0.01 * l * 500 * (x - y), 0.01 * l * 200 * (y - z)];
  }
  const hyab = (p, q) => Math.abs(p[0] - q[0]) + Math.hypot(p[1] - q[1], p[2] - q[2]);

  function separable(plane, w, h, across, down) { // kernels of odd length; the border is repeated
    const pass = (from, kernel, horizontal) => {
      const to = new Float64Array(from.length);
      const radius = kernel.length >> 1;
      for (let y = 0; y < h; y++) {
        for (let x = 0; x < w; x++) {
          let sum = 0;
          for (let k = -radius; k <= radius; k++) {
            const at = horizontal
              ? y * w + Math.min(w - 1, Math.max(0, x + k))
              : Math.min(h - 1, Math.max(0, y + k)) * w + x;
            sum += kernel[k + radius] * from[at];
          }
          to[y * w + x] = sum;
        }
      }
      return to;
    };
    return pass(pass(plane, across, true), down, false);
  }

  const sum = (values) => values.reduce((all, each) => all + each, 0);

  function sensitivity(plane, w, h, parts) { // a sum of Gaussians (a, b) in degrees, as one filter of sum 1
    const radius = Math.ceil(3 * Math.sqrt(0.04 / (2 * Math.PI ** 2)) * PPD);
    const gaussians = parts.map(([a, b]) => {
      const kernel = [];
      for (let k = -radius; k <= radius; k++) kernel.push(Math.exp((-(Math.PI ** 2) * (k / PPD) ** 2) / b));
      return { weight: a * Math.sqrt(Math.PI / b), kernel };
    });
    const total = sum(gaussians.map(({ weight, kernel }) => weight * sum(kernel) ** 2));
    const out = new Float64Array(plane.length);
    for (const { weight, kernel } of gaussians) {
      separable(plane, w, h, kernel, kernel).forEach((v, i) => { out[i] += (weight / total) * v; });
    }
    return out;
  }

  function seen(picture) { // what an eye makes of a picture: filtered Lab, and the strength of edges and points
    const { width: w, height: h, data } = picture;
    const planes = [0, 1, 2].map(() => new Float64Array(w * h));
    for (let i = 0; i < w * h; i++) {
      const rgb = [0, 1, 2].map((c) => Math.min(1, Math.max(0, data[4 * i + c] || 0)));
      const [x, y, z] = times(TO_XYZ, ...rgb).map((v, c) => v / WHITE[c]);
      planes[0][i] = 116 * y - 16;
      planes[1][i] = 500 * (x - y);
      planes[2][i] = 200 * (y - z);
    }
    const grey = planes[0].map((v) => (v + 16) / 116);
    const filtered = [
      sensitivity(planes[0], w, h, [[1, 0.0047]]),
      sensitivity(planes[1], w, h, [[1, 0.0053]]),
      sensitivity(planes[2], w, h, [[34.1, 0.04], [13.5, 0.025]]),
    ];
    const colours = Array.from({ length: w * h }, (_, i) => {
      const y = (filtered[0][i] + 16) / 116;
      const xyz = [y + filtered[1][i] / 500, y, y - filtered[2][i] / 200].map((v, c) => v * WHITE[c]);
      return hunt(...times(FROM_XYZ, ...xyz).map((v) => Math.min(1, Math.max(0, v))));
    });
    return { colours, ...features(grey, w, h) };
  }

  function features(grey, w, h) {
    const deviation = 0.5 * 0.082 * PPD;
    const radius = Math.ceil(3 * deviation);
    const blur = [], first = [], second = [];
    for (let k = -radius; k <= radius; k++) {
      const g = Math.exp(-(k * k) / (2 * deviation * deviation));
      blur.push(g);
      first.push(-k * g);
      second.push((k * k / (deviation * deviation) - 1) * g);
    }
    const normal = (kernel) => {
      const positive = sum(kernel.filter((v) => v > 0)), negative = -sum(kernel.filter((v) => v < 0));
      return kernel.map((v) => (v > 0 ? v / positive : v / (negative || 1)));
    };
    const strength = (kernel) => {
      const x = separable(grey, w, h, normal(kernel), normal(blur));
      const y = separable(grey, w, h, normal(blur), normal(kernel));
      return x.map((v, i) => Math.hypot(v, y[i]));
    };
    return { edges: strength(first), points: strength(second) };
  }

  return (reference, test) => { // Float32Array of one value a pixel, 0 no difference, 1 the largest
    const p = seen(reference), q = seen(test);
    const largest = hyab(hunt(0, 1, 0), hunt(0, 0, 1)) ** 0.7;
    const knee = 0.4 * largest;
    return Float32Array.from(p.colours, (colour, i) => {
      const d = hyab(colour, q.colours[i]) ** 0.7;
      const hue = d < knee ? (0.95 / knee) * d : 0.95 + ((d - knee) / (largest - knee)) * 0.05;
      const feature = Math.max(Math.abs(p.edges[i] - q.edges[i]), Math.abs(p.points[i] - q.points[i]));
      return hue ** (1 - Math.sqrt(feature / Math.SQRT2));
    });
  };
})();
