// What the page uses of three. `three.js` is made of it, as three 0.187.0 from npm:
// npx esbuild three.entry.js --bundle --minify --format=esm --legal-comments=inline --outfile=three.js
export {
  AdditiveBlending, BoxGeometry, BufferAttribute, BufferGeometry, CanvasTexture, Color, DirectionalLight,
  DoubleSide, DynamicDrawUsage, GridHelper, Group, HemisphereLight, IcosahedronGeometry, InstancedMesh,
  Matrix4, Mesh, MeshBasicMaterial, MeshStandardMaterial, PerspectiveCamera, PlaneGeometry, Quaternion,
  Scene, SphereGeometry, SRGBColorSpace, Vector3, WebGLRenderer,
} from "three";
