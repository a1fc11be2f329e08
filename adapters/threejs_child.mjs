// three.js, in the page that browser_child.py keeps open. three's own shaders are used as they are.

let THREE, renderer;

export async function setup(library) {
  THREE = library;
  renderer = new THREE.WebGLRenderer({ antialias: false });
  renderer.setPixelRatio(1);
  renderer.toneMapping = THREE.NoToneMapping;
  renderer.shadowMap.type = THREE.BasicShadowMap;
  const gl = renderer.getContext();
  for (const needed of ['EXT_color_buffer_float', 'OES_texture_float_linear'])
    if (!gl.getExtension(needed)) throw new Error(`the device has no ${needed}`);
  const told = gl.getExtension('WEBGL_debug_renderer_info');
  return gl.getParameter(told ? told.UNMASKED_RENDERER_WEBGL : gl.RENDERER);
}

export async function draw(job) {
  const width = job.width * job.grid, height = job.height * job.grid;
  if (Math.max(width, height) > renderer.capabilities.maxTextureSize)
    throw new Error(`a picture of ${width} x ${height} is larger than ${renderer.capabilities.maxTextureSize}, the device's limit`);
  renderer.shadowMap.enabled = job.shadow_map.resolution > 0;
  const scene = new THREE.Scene(), made = [], around = new THREE.Box3();
  scene.background = new THREE.Color(0, 0, 0);
  const textures = job.textures.map(said => map(said.pixels, said.width, said.height, said.wrap));
  made.push(...textures);
  for (const shape of job.objects) {
    const look = material(job.materials[shape.material], textures, made), geometry = new THREE.BufferGeometry();
    geometry.setAttribute('position', new THREE.BufferAttribute(shape.positions, 3));
    geometry.setAttribute('normal', new THREE.BufferAttribute(shape.normals, 3));
    geometry.setAttribute('uv', new THREE.BufferAttribute(shape.uv, 2));
    const mesh = new THREE.Mesh(geometry, look);
    mesh.frustumCulled = false;
    mesh.castShadow = mesh.receiveShadow = true;
    geometry.computeBoundingBox();
    around.union(geometry.boundingBox);
    scene.add(mesh);
    made.push(geometry, look);
  }
  for (const said of job.lights) {
    if (!(Math.max(...said.intensity) > 0)) continue;
    const lamp = light(scene, said, job.unit);
    if (renderer.shadowMap.enabled) { shadows(lamp, said, job, around); made.push(lamp); }
  }
  const target = new THREE.WebGLRenderTarget(width, height, {
    type: THREE.FloatType, format: THREE.RGBAFormat, minFilter: THREE.NearestFilter, magFilter: THREE.NearestFilter,
    colorSpace: THREE.LinearSRGBColorSpace, depthTexture: new THREE.DepthTexture(width, height, THREE.FloatType),
  });
  renderer.setRenderTarget(target);
  renderer.render(scene, camera(job.camera, job.unit));
  const pixels = new Float32Array(4 * width * height);
  renderer.readRenderTargetPixels(target, 0, 0, width, height, pixels);
  renderer.setRenderTarget(null);
  target.depthTexture.dispose();
  for (const part of [target, ...made]) part.dispose();
  return pixels;
}

function colour(parts) {
  return new THREE.Color().setRGB(...parts, THREE.LinearSRGBColorSpace);
}

// A surface without a highlight is Lambert's: Phong's material would leave the rim of its Fresnel term. With one, the
// specular colour is white, for which that term is 1, and the strength comes from a map of one texel.
function material(said, textures, made) {
  const common = {
    color: colour(said.texture < 0 ? said.diffuse : [1, 1, 1]), side: THREE.DoubleSide,
    map: said.texture < 0 ? null : textures[said.texture],
  };
  const strength = Math.max(...said.specular);
  if (!(strength > 0)) return new THREE.MeshLambertMaterial(common);
  const specularMap = map(new Float32Array([strength, strength, strength, 1]), 1, 1, ['repeat', 'repeat']);
  made.push(specularMap);
  return new THREE.MeshPhongMaterial({ ...common, specular: colour([1, 1, 1]), specularMap, shininess: said.exponent });
}

function map(pixels, width, height, wrap) {
  const texture = new THREE.DataTexture(pixels, width, height, THREE.RGBAFormat, THREE.FloatType);
  const wraps = { clamp: THREE.ClampToEdgeWrapping, repeat: THREE.RepeatWrapping };
  [texture.wrapS, texture.wrapT] = wrap.map(word => wraps[word]);
  texture.minFilter = texture.magFilter = THREE.LinearFilter;
  texture.generateMipmaps = false;
  texture.colorSpace = THREE.NoColorSpace;
  texture.needsUpdate = true;
  return texture;
}

// A point's intensity is the light's, in a larger scene as much larger; a distant light's is its irradiance.
function light(scene, said, unit) {
  const most = Math.max(...said.intensity), tint = colour(said.intensity.map(part => part / most));
  let made;
  if (said.kind === 'point') {
    made = new THREE.PointLight(tint, most * unit ** 2, 0, 2);
    made.position.set(...said.place.map(part => part * unit));
  } else {
    made = new THREE.DirectionalLight(tint, most);
    made.position.set(...said.place.map(part => -part));
    scene.add(made.target);
  }
  scene.add(made);
  return made;
}

// The map is as wide and as deep as the scene is across, and looks at its middle; three's bias is a part of its depth.
function shadows(lamp, said, job, around) {
  const {resolution, bias, normal_bias} = job.shadow_map, middle = around.getCenter(new THREE.Vector3());
  const across = around.getSize(new THREE.Vector3()).length(), shadow = lamp.shadow, seen = shadow.camera;
  lamp.target.position.copy(middle);
  lamp.position.copy(middle).addScaledVector(new THREE.Vector3(...said.place), -across);
  [seen.left, seen.right, seen.bottom, seen.top] = [-across / 2, across / 2, -across / 2, across / 2];
  [seen.near, seen.far] = [across / 2, 1.5 * across];
  shadow.mapSize.set(resolution, resolution);
  shadow.bias = -bias * job.unit / across;
  shadow.normalBias = normal_bias * job.unit;
  lamp.castShadow = true;
}

function camera(said, unit) {
  const made = new THREE.PerspectiveCamera(
    2 * Math.atan(said.tan_y) * THREE.MathUtils.RAD2DEG, said.tan_x / said.tan_y, said.near * unit, said.far * unit);
  made.matrixAutoUpdate = false;
  made.matrix.fromArray(said.to_world.flat());  // its rows are our columns: a matrix for row vectors
  for (const index of [12, 13, 14]) made.matrix.elements[index] *= unit;
  made.updateMatrixWorld(true);
  return made;
}
