// Babylon.js, in the page that browser_child.py keeps open. Babylon's own materials are used as they are.

const B = window.BABYLON;
let engine;

export async function setup() {
  const canvas = document.createElement('canvas');
  engine = new B.Engine(canvas, false, { useHighPrecisionMatrix: true, stencil: false });
  const caps = engine.getCaps();
  if (!caps.textureFloatRender || !caps.textureFloatLinearFiltering)
    throw new Error('the device does not draw into float32 textures, or does not filter them');
  return engine.getGlInfo().renderer;
}

export async function draw(job) {
  const width = job.width * job.grid, height = job.height * job.grid, largest = engine.getCaps().maxTextureSize;
  if (Math.max(width, height) > largest)
    throw new Error(`a picture of ${width} x ${height} is larger than ${largest}, the device's limit`);
  const scene = new B.Scene(engine);
  try {
    return await drawn(scene, job, width, height);
  } finally {
    scene.dispose();
  }
}

async function drawn(scene, job, width, height) {
  scene.useRightHandedSystem = true;
  scene.ambientColor = new B.Color3(0, 0, 0);
  scene.imageProcessingConfiguration.applyByPostProcess = true;  // and there is no such process
  scene.imageProcessingConfiguration.skipFinalColorClamp = true;  // at 30
  const looks = job.materials.map(said => material(scene, said, job.textures));
  const meshes = job.objects.map((shape, index) => mesh(scene, shape, index, looks));
  for (const said of job.lights) if (Math.max(...said.intensity) > 0) light(scene, said, job.unit);
  const target = new B.RenderTargetTexture('picture', { width, height }, scene, {
    generateMipMaps: false, type: B.Constants.TEXTURETYPE_FLOAT, format: B.Constants.TEXTUREFORMAT_RGBA,
    samplingMode: B.Constants.TEXTURE_NEAREST_SAMPLINGMODE, generateDepthBuffer: false,
  });
  target.createDepthStencilTexture(0, false, false, 1, B.Constants.TEXTUREFORMAT_DEPTH32_FLOAT);
  Object.assign(target, {
    activeCamera: camera(scene, job.camera, job.unit), renderList: meshes, clearColor: new B.Color4(0, 0, 0, 1),
    ignoreCameraViewport: true, useCameraPostProcesses: false,
  });
  scene.activeCamera = target.activeCamera;
  await scene.whenReadyAsync();
  for (const shape of meshes) await shape.material.forceCompilationAsync(shape);
  scene.incrementRenderId();
  scene.updateTransformMatrix(true);
  target.render();
  const pixels = await target.readPixels();
  return new Float32Array(pixels.buffer, pixels.byteOffset, 4 * width * height);
}

// A surface without a highlight is a PBRMaterial, the only one whose point lights fall with the distance's square. A
// shiny one is a StandardMaterial, which has Blinn's highlight.
function material(scene, said, textures) {
  const shiny = Math.max(...said.specular) > 0, colour = said.texture < 0 ? said.diffuse : [1, 1, 1];
  const map = said.texture < 0 ? null : textures[said.texture];  // each material has its own, for the brightness of one
  const made = shiny ? standard(scene, said, colour, map) : lambert(scene, colour, map);
  // Our corners go round a face against the clock, which Babylon takes for the back.
  Object.assign(made, { backFaceCulling: false, twoSidedLighting: true, maxSimultaneousLights: 16, sideOrientation: 1 });
  return made;
}

function lambert(scene, colour, map) {
  const made = new B.PBRMaterial('', scene);
  Object.assign(made, {
    albedoColor: new B.Color3(...colour), albedoTexture: map && texture(scene, map), usePhysicalLightFalloff: true,
    metallic: 0, roughness: 1, metallicF0Factor: 0, specularIntensity: 0, environmentIntensity: 0,
  });
  made.brdf.baseDiffuseModel = B.Constants.MATERIAL_DIFFUSE_MODEL_LAMBERT;
  made.brdf.useEnergyConservation = false;
  return made;
}

// This material has no 1/pi, and it cuts light times colour off at 1, before the texture: so that carries the brightness.
function standard(scene, said, colour, map) {
  const made = new B.StandardMaterial('', scene), level = 1024;
  made.imageProcessingConfiguration = new B.ImageProcessingConfiguration();
  made.imageProcessingConfiguration.isEnabled = false;  // else its colours are taken for encoded ones and decoded
  made.diffuseTexture = texture(scene, map ?? {
    pixels: new Float32Array([1, 1, 1, 1]), width: 1, height: 1, wrap: ['repeat', 'repeat'] });
  made.diffuseTexture.level = level;
  made.diffuseColor = new B.Color3(...colour.map(part => part / (Math.PI * level)));
  made.specularColor = new B.Color3(...said.specular.map(part => part / Math.PI));
  made.specularPower = said.exponent;
  return made;
}

function texture(scene, said) {
  const made = new B.RawTexture(
    said.pixels, said.width, said.height, B.Constants.TEXTUREFORMAT_RGBA, scene, false, false,
    B.Constants.TEXTURE_BILINEAR_SAMPLINGMODE, B.Constants.TEXTURETYPE_FLOAT);
  const wraps = { clamp: B.Constants.TEXTURE_CLAMP_ADDRESSMODE, repeat: B.Constants.TEXTURE_WRAP_ADDRESSMODE };
  [made.wrapU, made.wrapV] = said.wrap.map(word => wraps[word]);
  made.gammaSpace = false;
  made.anisotropicFilteringLevel = 1;  // 4 where nobody says: a mean along the line of sight, not the bilinear value
  return made;
}

function mesh(scene, shape, index, looks) {
  const made = new B.Mesh(`${index}`, scene), data = new B.VertexData();
  data.positions = shape.positions;
  data.normals = shape.normals;
  data.uvs = shape.uv;
  data.indices = Uint32Array.from({ length: shape.positions.length / 3 }, (_, corner) => corner);
  data.applyToMesh(made);
  made.alwaysSelectAsActiveMesh = true;
  made.material = looks[shape.material];
  return made;
}

// A point's intensity is the light's, a distant light's its irradiance.
function light(scene, said, unit) {
  const most = Math.max(...said.intensity), place = new B.Vector3(...said.place);
  const made = said.kind === 'point'
    ? new B.PointLight('', place.scaleInPlace(unit), scene) : new B.DirectionalLight('', place, scene);
  made.diffuse = made.specular = new B.Color3(...said.intensity.map(part => part / most));
  made.intensity = said.kind === 'point' ? most * unit ** 2 : most;
  if (said.kind === 'point') {
    made.falloffType = B.Light.FALLOFF_PHYSICAL;
    made.intensityMode = B.Light.INTENSITYMODE_LUMINOUSINTENSITY;
  }
}

function camera(scene, said, unit) {
  const rows = said.to_world, near = said.near * unit, far = said.far * unit;
  const place = rows[3].map(part => part * unit);
  const made = new B.FreeCamera('', new B.Vector3(...place), scene);
  const world = B.Matrix.FromArray([...rows.slice(0, 3).flat(), ...place.slice(0, 3), 1]);
  made._computedViewMatrix = B.Matrix.Invert(world);  // a camera's own is made of angles
  made.getViewMatrix = () => made._computedViewMatrix;
  made._globalPosition.copyFrom(made.position);
  made.freezeProjectionMatrix(B.Matrix.FromArray([
    1 / said.tan_x, 0, 0, 0, 0, 1 / said.tan_y, 0, 0,
    0, 0, -(far + near) / (far - near), -1, 0, 0, -2 * far * near / (far - near), 0]));
  return made;
}
